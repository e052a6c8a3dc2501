#!/usr/bin/env python3
"""Counts the states of the same nets with Armor, pm4py and SNAKES, in one run, and prints a table.

    cargo build --release -p armor
    python3 bench/petri_peers.py [--most STATES] [FILE.pnml|FILE.net|MISSION.xml ...]

The nets are made here (the contest's Philosophers and TokenRing, Ciardo's Kanban) or are example
missions; each becomes PNML by `armor net convert`, and all three read that file. pm4py and SNAKES
come from PyPI, into an environment below target/ that this script makes itself.

pm4py and SNAKES are given the nets of up to 5,000 states (`--most` for others): more takes minutes.
Of them only the building of the reachability graph is timed; of Armor the whole process, from its
start through reading the file to its end. If two programs count differently, that is an error.
"""

import argparse
import json
import os
import pathlib
import subprocess
import sys
import time
import xml.etree.ElementTree as xml

ROOT = pathlib.Path(__file__).resolve().parent.parent
TARGET = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
ENVIRONMENT = TARGET / "petri-peers"
PACKAGES = ["pm4py==2.7.23.11", "SNAKES==0.9.33"]
ROUNDS = 3


def kanban(tokens):
    """Four cells; the second and third are filled and emptied together."""
    lines = [f"net Kanban_{tokens}"]
    for cell in range(1, 5):
        lines.append(f"pl P{cell} ({tokens})")
        lines.append(f"tr redo{cell} M{cell} -> B{cell}")
        lines.append(f"tr back{cell} B{cell} -> M{cell}")
        lines.append(f"tr ok{cell} M{cell} -> O{cell}")
    lines.append("tr in P4 -> M4")
    lines.append("tr split P2 P3 O4 -> P4 M2 M3")
    lines.append("tr join P1 O2 O3 -> P2 P3 M1")
    lines.append("tr out O1 -> P1")
    return lines


def philosophers(count):
    """Each takes the fork at either hand first, then the other."""
    lines = [f"net Philosophers_{count}"]
    for own in range(count):
        other = (own + 1) % count
        lines.append(f"pl Think{own} (1)")
        lines.append(f"pl Fork{own} (1)")
        lines.append(f"tr own{own} Think{own} Fork{own} -> First{own}")
        lines.append(f"tr others{own} Think{own} Fork{other} -> Second{own}")
        lines.append(f"tr both{own} First{own} Fork{other} -> Eat{own}")
        lines.append(f"tr either{own} Second{own} Fork{own} -> Eat{own}")
        lines.append(f"tr end{own} Eat{own} -> Think{own} Fork{own} Fork{other}")
    return lines


def token_ring(count):
    """Dijkstra's self-stabilising ring: one process counts on, the others copy their neighbour."""
    lines = [f"net TokenRing_{count}"]
    values = range(count + 1)
    state = "s{}_{}".format
    for process in values:
        lines.append(f"pl {state(process, process)} (1)")
    for value in values:
        after = (value + 1) % (count + 1)
        lines.append(
            f"tr main{value} {state(0, value)} {state(count, value)}"
            f" -> {state(0, after)} {state(count, value)}"
        )
    for process in values[1:]:
        for value in values:
            for before in values:
                if value != before:
                    lines.append(
                        f"tr t{process}_{value}_{before} {state(process, value)}"
                        f" {state(process - 1, before)}"
                        f" -> {state(process, before)} {state(process - 1, before)}"
                    )
    return lines


# What was published of them: Ciardo and Trivedi, 1993, and the Model Checking Contest.
MADE = [
    ("Philosophers-5", philosophers(5), (243, 945)),
    ("Philosophers-6", philosophers(6), (729, 3402)),
    ("TokenRing-5", token_ring(5), (166, 365)),
    ("Kanban-2", kanban(2), (4600, 28120)),
    ("Philosophers-10", philosophers(10), (59049, 459270)),
    ("TokenRing-10", token_ring(10), (58905, 294050)),
    ("Kanban-5", kanban(5), (2546432, 24460016)),
]
MISSIONS = ["patrol", "meeting"]


def read_pnml(path):
    """Places with tokens, and transitions with weighted inputs and outputs; plain arcs only."""

    def named(element, name):
        return [child for child in element.iter() if child.tag.split("}")[-1] == name]

    def number(element, name, missing):
        texts = [t.text for label in named(element, name) for t in named(label, "text")]
        return int(texts[0]) if texts else missing

    root = xml.parse(path).getroot()
    places = {p.get("id"): number(p, "initialMarking", 0) for p in named(root, "place")}
    transitions = {t.get("id"): ({}, {}) for t in named(root, "transition")}
    for arc in named(root, "arc"):
        if named(arc, "type"):
            raise SystemExit(f"{path}: an arc of another kind")
        source, target, weight = arc.get("source"), arc.get("target"), number(arc, "inscription", 1)
        arcs, place = (
            (transitions[target][0], source)
            if source in places
            else (transitions[source][1], target)
        )
        arcs[place] = arcs.get(place, 0) + weight
    return places, transitions


def count_pm4py(path):
    import pm4py
    from pm4py.objects.petri_net.utils import reachability_graph

    net, marking, _ = pm4py.read_pnml(path)
    start = time.perf_counter()
    graph = reachability_graph.construct_reachability_graph(net, marking)
    return time.perf_counter() - start, len(graph.states)


def count_snakes(path):
    from snakes.nets import MultiArc, PetriNet, Place, StateGraph, Transition, Value, dot

    places, transitions = read_pnml(path)
    net = PetriNet("n")
    for name, tokens in places.items():
        net.add_place(Place(name, [dot] * tokens))
    for name, (inputs, outputs) in transitions.items():
        net.add_transition(Transition(name))
        for add, arcs in [(net.add_input, inputs), (net.add_output, outputs)]:
            for place, weight in arcs.items():
                add(place, name, Value(dot) if weight == 1 else MultiArc([Value(dot)] * weight))
    start = time.perf_counter()
    graph = StateGraph(net)
    graph.build()
    return time.perf_counter() - start, len(graph)


COUNTERS = {"pm4py": count_pm4py, "SNAKES": count_snakes}


def peer(name, path):
    """Seconds and states, in a process of its own."""
    command = [sys.executable, __file__, "--count", name, str(path)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(f"{name} cannot count {path}:\n{done.stderr}")
    return tuple(json.loads(done.stdout.splitlines()[-1]))


def armor(program, *arguments):
    done = subprocess.run([program, "net", *arguments], capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(f"armor net {' '.join(arguments)}:\n{done.stderr}")
    return done.stdout


def armor_counts(program, path):
    start = time.perf_counter()
    info = json.loads(armor(program, "info", "--format", "json", str(path)))
    return time.perf_counter() - start, info


def best(measure):
    """The quickest of a few rounds; one round where it takes long."""
    found = measure()
    for _ in range(ROUNDS - 1):
        if found[0] > 5:
            break
        found = min(found, measure(), key=lambda one: one[0])
    return found


def shown(seconds, states):
    return f"{seconds:.3f} | {states / seconds:,.0f}"


def measure(program, name, path, published, most):
    seconds, info = best(lambda: armor_counts(program, path))
    states, edges = info["states"], info["edges"]
    if published and (states, edges) != published:
        raise SystemExit(f"{name}: armor counts {states}/{edges}, published is {published}")
    cells = [f"{name} | {states:,} | {edges:,}", shown(seconds, states)]
    for peer_name in COUNTERS:
        if states > most:
            cells.append(" | ")
            continue
        found = best(lambda: peer(peer_name, path))
        if found[1] != states:
            raise SystemExit(f"{name}: armor counts {states}, {peer_name} {found[1]}")
        cells.append(shown(*found))
    print(f"| {' | '.join(cells)} |", flush=True)


def in_environment():
    """Runs this script again where pm4py and SNAKES are, which is made if it is not there."""
    python = ENVIRONMENT / "bin" / "python"
    ready = ENVIRONMENT / "ready"
    if not ready.exists() or ready.read_text() != repr(PACKAGES):
        print("installing " + ", ".join(PACKAGES), file=sys.stderr)
        subprocess.run([sys.executable, "-m", "venv", str(ENVIRONMENT)], check=True)
        subprocess.run([str(python), "-m", "pip", "install", "-q", *PACKAGES], check=True)
        ready.write_text(repr(PACKAGES))
    os.execv(python, [str(python), __file__, *sys.argv[1:]])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="*", help="other nets, instead of those made here")
    parser.add_argument("--armor", default=str(TARGET / "release" / "armor"))
    parser.add_argument("--most", type=int, default=5000, help="states that the peers are given")
    parser.add_argument("--count", nargs=2, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.count:
        name, path = options.count
        print(json.dumps(COUNTERS[name](path)))
        return
    if pathlib.Path(sys.prefix) != ENVIRONMENT:
        in_environment()
    folder = TARGET / "petri-peers" / "nets"
    folder.mkdir(exist_ok=True)
    nets = [(pathlib.Path(file).stem, file, None) for file in options.files]
    if not nets:
        for name, lines, published in MADE:
            file = folder / f"{name}.net"
            file.write_text("\n".join(lines) + "\n")
            nets.append((name, file, published))
        nets += [(f"missions/{m}.xml", ROOT / "missions" / f"{m}.xml", None) for m in MISSIONS]
    print("| net | states | edges | Armor, s | states/s | pm4py, s | states/s | SNAKES, s | states/s |")
    print("| --- " + "| ---: " * 8 + "|")
    for name, file, published in nets:
        path = folder / (pathlib.Path(file).stem + ".pnml")
        armor(options.armor, "convert", str(file), str(path))
        measure(options.armor, name, path, published, options.most)


if __name__ == "__main__":
    main()

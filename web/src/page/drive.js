// Control of the robot: a stick that drives while it is held, and the release of STOP.
'use strict';

const Drive = (() => {
  const SEND_EVERY_MS = 100;
  const control = document.getElementById('control');
  const release = document.getElementById('release');
  const note = document.getElementById('drive-note');
  const stick = document.getElementById('stick');
  const knob = document.getElementById('knob');
  const KEYS = {
    KeyW: [1, 0], ArrowUp: [1, 0], KeyS: [-1, 0], ArrowDown: [-1, 0],
    KeyA: [0, 1], ArrowLeft: [0, 1], KeyD: [0, -1], ArrowRight: [0, -1],
  };
  const pressed = new Set();
  let socket = null;
  let limits = null;
  let held = [0, 0];
  let wasMoving = false;
  let isStopped = false;

  const isInControl = () => socket && socket.readyState === WebSocket.OPEN;

  function show() {
    control.textContent = isInControl() ? 'Give control back' : 'Take control';
    control.disabled = !Session.may('operator');
    control.title = Session.why('operator');
    stick.hidden = !isInControl() || !limits;
    release.hidden = !isStopped;
    release.disabled = !isInControl();
    release.title = isInControl() ? '' : 'take control first';
  }

  function take(isForced) {
    const opened = new WebSocket(socketUrl(`/api/control${isForced ? '?take=true' : ''}`));
    let wasOpen = false;
    let why = '';
    const beat = setInterval(() => { if (opened.readyState === 1) opened.send('{}'); }, 1000);
    opened.onopen = () => { wasOpen = true; socket = opened; show(); };
    opened.onmessage = (event) => {
      const message = JSON.parse(event.data);
      if (message.control) {
        limits = message.drive;
        note.textContent = limits
          ? `up to ${limits.speed_mps} m/s; keys W A S D`
          : 'In control. Driving needs a component of kind web-view in the system.';
      } else if (message.error) {
        note.textContent = `${message.error.what}: ${message.error.remedy}`;
      } else if (message.lost) {
        why = message.lost;
      } else if (message.stopped === false) {
        note.textContent = message.text;
      }
      show();
    };
    opened.onclose = () => {
      clearInterval(beat);
      if (socket === opened) socket = null;
      note.textContent = why || (wasOpen ? 'No control.' : 'Another client may be in control.');
      if (!wasOpen && !isForced) {
        control.textContent = 'Take it over';
        control.dataset.force = 'yes';
        return;
      }
      letGo();
      show();
    };
  }

  control.addEventListener('click', () => {
    if (isInControl()) { letGo(); socket.close(); return; }
    const isForced = control.dataset.force === 'yes';
    delete control.dataset.force;
    take(isForced);
  });
  release.addEventListener('click', () => {
    if (isInControl()) socket.send(JSON.stringify({release: true}));
  });

  function letGo() {
    held = [0, 0];
    pressed.clear();
    knob.style.transform = '';
    send();
  }

  function direction() {
    const keys = [...pressed].map((code) => KEYS[code]);
    const sum = keys.reduce(([a, b], [c, d]) => [a + c, b + d], held);
    return sum.map((part) => Math.max(-1, Math.min(1, part)));
  }

  function send() {
    if (!isInControl() || !limits) return;
    const [forward, turn] = direction();
    const isMoving = forward !== 0 || turn !== 0;
    if (!isMoving && !wasMoving) return;
    wasMoving = isMoving;
    socket.send(JSON.stringify({
      drive: {forward_mps: forward * limits.speed_mps, turn_radps: turn * limits.turn_radps}}));
  }
  setInterval(send, SEND_EVERY_MS);

  stick.addEventListener('pointerdown', (event) => {
    stick.setPointerCapture(event.pointerId);
    move(event);
  });
  stick.addEventListener('pointermove', (event) => {
    if (stick.hasPointerCapture(event.pointerId)) move(event);
  });
  ['pointerup', 'pointercancel', 'lostpointercapture'].forEach((name) =>
    stick.addEventListener(name, letGo));

  function move(event) {
    const box = stick.getBoundingClientRect();
    const radius = box.width / 2 - 24;
    let [x, y] = [event.clientX - box.left - box.width / 2, event.clientY - box.top - box.height / 2];
    const length = Math.hypot(x, y);
    if (length > radius) [x, y] = [x * radius / length, y * radius / length];
    knob.style.transform = `translate(${x}px, ${y}px)`;
    const dead = (part) => (Math.abs(part) < 0.12 ? 0 : part);
    held = [dead(-y / radius), dead(-x / radius)];
    send();
  }

  document.addEventListener('keydown', (event) => {
    if (!KEYS[event.code] || !isInControl() || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    if (!pressed.has(event.code)) { pressed.add(event.code); send(); }
  });
  document.addEventListener('keyup', (event) => { if (pressed.delete(event.code)) send(); });
  window.addEventListener('blur', letGo);
  document.addEventListener('visibilitychange', () => { if (document.hidden) letGo(); });
  window.addEventListener('pagehide', letGo);
  Session.listen(show);
  show();
  return {setStopped: (on) => { isStopped = on; show(); }};
})();

// STOP, with a connection of its own that is open before it is needed.
//
// The page shows this button in a frame from the other name of this host (localhost or 127.0.0.1):
// a browser runs that in a process of its own, so it works while the rest of the page hangs. Where
// the frame cannot be loaded, and over HTTPS, the button of the page itself does the same.
'use strict';

const Stop = (() => {
  // Longest time after a press in which STOP is ordered again: later the robot would stop by itself, when
  // the person has long used the switch.
  const ORDERED_FOR_MS = 60000;
  // The server answers an order within 6 s, also if others wait.
  const ORDERED_EVERY_MS = 6000;

  const UNANSWERED = 'STOP not confirmed: the robot may be moving';
  const REPEATED = 'STOP not confirmed, ordered again: use the switch if the robot moves';
  const UNCONFIRMED = 'STOP not confirmed: use the switch on the robot';
  const REFUSED = 'STOP not delivered: use the switch on the robot';
  const RELEASED = 'STOP was released: press again to stop the robot';

  const button = document.getElementById('stop');
  const listeners = [];
  let socket = null;
  // Whether the connection has not answered since the last order over it: it may be dead.
  let isSilent = false;
  // The number of the last order, and of the first one of the last press.
  let newest = 0;
  let first = 1;
  // The last press, until its STOP is confirmed, refused or given up.
  let waiting = null;

  function show(text, state) {
    button.textContent = text;
    button.dataset.state = state;
    listeners.forEach((listener) => listener(state, text));
    if (window.parent !== window) window.parent.postMessage({stop: state, text}, '*');
  }

  function isOpen() {
    return Boolean(socket) && socket.readyState === WebSocket.OPEN;
  }

  function showReadiness() {
    if (isOpen()) show('STOP', 'ready');
    else show('STOP (not connected)', 'lost');
  }

  function connect() {
    // In the frame no one logs in.
    if (typeof Session !== 'undefined' && !Session.isOpen()) { setTimeout(connect, 500); return; }
    const scheme = location.protocol === 'https:' ? 'wss' : 'ws';
    const opened = new WebSocket(`${scheme}://${location.host}/api/stop/live`);
    socket = opened;
    let beat = null;
    opened.onopen = () => {
      isSilent = false;
      beat = setInterval(() => opened.send(JSON.stringify({id: newest})), 1000);
      if (waiting) order();
      else noteConnection();
    };
    opened.onmessage = (event) => {
      isSilent = false;
      const answer = JSON.parse(event.data);
      if (answer.state) noteState(answer.state, answer.id);
      else noteAnswer(answer, answer.id);
    };
    opened.onclose = () => {
      clearInterval(beat);
      noteConnection();
      setTimeout(connect, 1000);
    };
  }

  function noteConnection() {
    if (waiting) {
      if (button.dataset.state === 'sent') show(UNANSWERED, 'failed');
      return;
    }
    // A refusal stays in sight until the next press.
    if (!['failed', 'done'].includes(button.dataset.state)) showReadiness();
  }

  // Takes the answer to an order. Any order of the press confirms it. Only the newest refuses it: the
  // others may have been refused before the robot's components were connected.
  function noteAnswer(answer, number) {
    if (answer.stopped === true && number >= first) confirm();
    else if (!waiting || number !== newest) return;
    // The server has tried all means, or knows that there are none. The body is looked at because a
    // reverse proxy in front of a dead server answers 502, too.
    else if (answer.error && answer.error.status === 502) end(REFUSED);
    else show(REPEATED, 'failed');
  }

  // Another client's STOP may be released while this one is ordered again.
  function noteState(state, number) {
    if (!waiting || number < first) return;
    if (state.ordered) waiting.wasInForce = true;
    else if (state.ordered === false && waiting.wasInForce) end(RELEASED);
  }

  function forget() {
    if (!waiting) return;
    clearInterval(waiting.repeating);
    clearTimeout(waiting.ending);
    // One that is still on its way would stop the robot after its release.
    waiting.posts.abort();
    waiting = null;
  }

  function confirm() {
    forget();
    show('STOPPED', 'done');
    setTimeout(() => { if (button.dataset.state === 'done') showReadiness(); }, 3000);
  }

  function end(text) {
    forget();
    show(text, 'failed');
  }

  function order() {
    // Timers do not run while a device sleeps.
    if (Date.now() >= waiting.until) { end(UNCONFIRMED); return; }
    newest += 1;
    const number = newest;
    if (number > first) show(REPEATED, 'failed');
    if (isOpen() && !isSilent) {
      isSilent = true;
      socket.send(JSON.stringify({stop: true, id: number}));
      return;
    }
    fetch('/api/stop', {method: 'POST', signal: waiting.posts.signal})
      .then((response) => response.json().catch(() => ({})))
      .then((answer) => noteAnswer(answer, number))
      .catch(() => {});
  }

  function press() {
    // What an earlier press has sent may still be delivered.
    const posts = waiting ? waiting.posts : new AbortController();
    if (waiting) { clearInterval(waiting.repeating); clearTimeout(waiting.ending); }
    const own = {
      posts,
      until: Date.now() + ORDERED_FOR_MS,
      // The clock may be put back. This timer is the first, so it ends the press before the last interval.
      ending: setTimeout(() => end(UNCONFIRMED), ORDERED_FOR_MS),
      repeating: setInterval(order, ORDERED_EVERY_MS),
      wasInForce: false,
    };
    waiting = own;
    first = newest + 1;
    show('STOP sent', 'sent');
    order();
    setTimeout(() => {
      if (waiting === own && button.dataset.state === 'sent') show(UNANSWERED, 'failed');
    }, 1000);
  }

  button.addEventListener('pointerdown', press);
  button.addEventListener('keydown', (event) => { if (event.key === 'Enter') press(); });
  document.addEventListener('keydown', (event) => {
    if (event.code === 'Space' && !event.repeat && !/INPUT|TEXTAREA/.test(event.target.tagName)) {
      event.preventDefault();
      press();
    }
  }, true);
  connect();
  return {press, listen: (listener) => listeners.push(listener)};
})();

// The page replaces its own button by the frame once that is connected.
(() => {
  const frame = document.getElementById('stop-frame');
  // Over HTTPS the session belongs to one name of the robot.
  if (!frame || location.protocol === 'https:') return;
  const own = document.getElementById('stop');
  const other = location.hostname === 'localhost' ? '127.0.0.1' : 'localhost';
  const url = new URL(`http://${other}:${location.port || 80}/stop.html`);
  let isUsable = false;
  const choose = () => {
    // A STOP by Space that is not confirmed must be seen, and so must a frame without a connection.
    const isOwn = !isUsable || ['sent', 'failed'].includes(own.dataset.state);
    frame.hidden = isOwn;
    own.hidden = !isOwn;
  };
  window.addEventListener('message', (event) => {
    if (event.source !== frame.contentWindow || event.origin !== url.origin) return;
    isUsable = Boolean(event.data && event.data.stop) && event.data.stop !== 'lost';
    choose();
  });
  Stop.listen(choose);
  frame.src = url.href;
})();

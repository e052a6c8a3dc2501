// STOP, with a connection of its own that is open before it is needed.
//
// The page shows this button in a frame from the other name of this host (localhost or 127.0.0.1):
// a browser runs that in a process of its own, so it works while the rest of the page hangs. Where
// the frame cannot be loaded, and over HTTPS, the button of the page itself does the same.
'use strict';

const Stop = (() => {
  const button = document.getElementById('stop');
  const listeners = [];
  let socket = null;
  let sent = 0;
  // The last STOP, until the server has confirmed or refused it.
  let waiting = null;

  function show(text, state) {
    button.textContent = text;
    button.dataset.state = state;
    listeners.forEach((listener) => listener(state, text));
    if (window.parent !== window) window.parent.postMessage({stop: state, text}, '*');
  }

  function connect() {
    // In the frame no one logs in.
    if (typeof Session !== 'undefined' && !Session.isOpen()) { setTimeout(connect, 500); return; }
    const scheme = location.protocol === 'https:' ? 'wss' : 'ws';
    const opened = new WebSocket(`${scheme}://${location.host}/api/stop/live`);
    socket = opened;
    let beat = null;
    opened.onopen = () => {
      beat = setInterval(() => opened.send('{}'), 5000);
      // A STOP without an answer is ordered again. One that was refused is not: the person has been
      // sent to the switch, and the robot must not stop by itself minutes later.
      if (waiting) order();
      else show('STOP', 'ready');
    };
    opened.onmessage = (event) => {
      const answer = JSON.parse(event.data);
      if (answer.error) {
        if (answer.id === waiting) refuse(answer.error.status);
      } else if (answer.stopped && answer.id >= waiting) confirm();
    };
    opened.onclose = () => {
      clearInterval(beat);
      if (waiting) show('STOP not delivered: the robot may be moving', 'failed');
      // A refusal stays in sight.
      else if (button.dataset.state !== 'failed') show('STOP (not connected)', 'lost');
      setTimeout(connect, 1000);
    };
  }

  function confirm() {
    waiting = null;
    show('STOPPED', 'done');
    setTimeout(() => { if (button.dataset.state === 'done') show('STOP', 'ready'); }, 3000);
  }

  function refuse(status) {
    // Another press helps no more: the server has tried all means, or knows that there are none.
    show('STOP not delivered: use the switch on the robot', 'failed');
    // With any other status (504) the order may still be on its way.
    if (status === 502) waiting = null;
  }

  function send() {
    const number = waiting;
    if (socket && socket.readyState === WebSocket.OPEN) {
      socket.send(JSON.stringify({stop: true, id: number}));
      return;
    }
    fetch('/api/stop', {method: 'POST'})
      .then((response) => {
        if (waiting !== number) return;
        if (response.ok) confirm();
        else if (response.status === 502) refuse(response.status);
      })
      .catch(() => {});
  }

  function order() {
    show('STOP sent', 'sent');
    send();
    const number = waiting;
    setTimeout(() => {
      const isUnanswered = waiting === number && button.dataset.state === 'sent';
      if (isUnanswered) show('STOP not confirmed: the robot may be moving', 'failed');
    }, 1000);
  }

  function press() {
    sent += 1;
    waiting = sent;
    order();
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

// Who uses the page: on the robot's own computer its user, elsewhere a person with an invitation.
'use strict';

const Session = (() => {
  const RANKS = {observer: 0, operator: 1, engineer: 2};
  const find = (id) => document.getElementById(id);
  const listeners = [];
  // Until the server has answered, the page behaves as where no one logs in.
  let now = {login: 'unknown'};
  let since_ms = 0;

  const isOpen = () => now.login !== 'needed';
  const may = (role) => now.login !== 'done' || RANKS[now.role] >= RANKS[role];
  const why = (role) => (may(role) ? '' : `needs the role ${role}; ${now.name} has the role ${now.role}`);

  function set(next) {
    const before = now;
    now = next;
    since_ms = performance.now();
    // Nothing that was shown to a person stays in sight.
    if (before.login === 'done' && next.login === 'needed') { location.reload(); return; }
    show();
    if (before.login !== next.login || before.role !== next.role) listeners.forEach((listener) => listener());
  }

  function show() {
    find('login').hidden = isOpen();
    document.querySelector('footer').hidden = !isOpen();
    find('log-out').hidden = find('who').hidden = now.login !== 'done';
    find('role-note').hidden = may('operator');
    if (now.login === 'needed') {
      find('login-host').textContent = now.host;
      const ended = now.ended_s && new Date(now.ended_s * 1000).toLocaleString();
      const problem = ended ? `your invitation expired at ${ended}` : now.problem || '';
      // Why a link was not accepted stays in sight.
      if (problem) find('login-problem').textContent = `${problem[0].toUpperCase()}${problem.slice(1)}.`;
    }
    if (now.login === 'done') {
      // The clock of a phone may differ from the robot's.
      const left = now.left_s - (performance.now() - since_ms) / 1000;
      const soon = left < 900 ? `, ${Math.max(1, Math.round(left / 60))} min left` : '';
      find('who').textContent = `${now.name} · ${now.role}${soon}`;
      find('who').title = `until ${new Date(now.until_s * 1000).toLocaleString()}`;
      find('role-note').textContent = `As ${now.role} you see everything, and may stop the robot, pause `
        + 'the mission and send it to its safe place. Other orders need the role operator.';
    }
  }

  async function check() {
    try {
      const response = await fetch('/api/session');
      if (response.ok) set(await response.json());
    } catch { /* Without a connection it stays as it is. */ }
  }

  // Sent with the invitation until an answer has arrived: a login whose answer was lost uses no second
  // place, and another browser that has the link does not know it.
  const ATTEMPT = 'armor-login-attempt';
  const storage = {
    read: () => { try { return localStorage.getItem(ATTEMPT); } catch { return null; } },
    write: (text) => { try { localStorage.setItem(ATTEMPT, text); } catch { /* For this page alone. */ } },
    remove: () => { try { localStorage.removeItem(ATTEMPT); } catch { /* There is none. */ } },
  };
  let attempt = null;
  function drawAttempt() {
    attempt = attempt || storage.read();
    if (!/^[0-9a-f]{40}$/.test(attempt || '')) {
      const bytes = crypto.getRandomValues(new Uint8Array(20));
      attempt = [...bytes].map((byte) => byte.toString(16).padStart(2, '0')).join('');
      storage.write(attempt);
    }
    return attempt;
  }
  function forgetAttempt() { attempt = null; storage.remove(); }

  async function logIn(text) {
    const [secret] = text.match(/[0-9a-f]{40}/i) || [];
    const problem = find('login-problem');
    if (!secret) { problem.textContent = 'This is no link of an invitation.'; return; }
    problem.textContent = '…';
    // It stays there until it was used: without a connection it is tried again.
    find('invite').value = secret;
    const send = (replace) => fetch('/api/login', {method: 'POST',
      headers: {'Content-Type': 'application/json'}, body: JSON.stringify({invite: secret.toLowerCase(), attempt: drawAttempt(), replace})});
    try {
      let response = await send(false);
      if (response.status === 409 && now.login === 'done') {
        if (!confirm(`You are ${now.name} (${now.role}). Log out, and log in with this invitation?`)) {
          find('invite').value = '';
          return;
        }
        response = await send(true);
      }
      const answer = await response.json();
      if (response.ok) { find('invite').value = ''; forgetAttempt(); await check(); return; }
      await check();
      if (isOpen()) return;
      problem.textContent = `${answer.error.what}.`;
    } catch {
      problem.textContent = 'No connection to the robot: try again.';
    }
  }

  // The secret leaves the address immediately, so that no one copies it from there.
  async function readLink() {
    const secret = new URLSearchParams(location.hash.slice(1)).get('invite');
    if (secret === null) { await check(); return; }
    history.replaceState(null, '', location.pathname);
    await check();
    if (now.login === 'not needed') return;
    await logIn(secret);
  }

  find('log-in').addEventListener('click', () => logIn(find('invite').value));
  find('invite').addEventListener('keydown', (event) => {
    if (event.key === 'Enter') logIn(event.target.value);
  });
  find('log-out').addEventListener('click', async () => {
    const isOut = await fetch('/api/logout', {method: 'POST'}).then((response) => response.ok, () => false);
    if (!isOut) alert('You are still logged in: the robot did not answer, or could not save it. Try again.');
    await check();
  });
  window.addEventListener('hashchange', readLink);
  setInterval(() => { if (now.login === 'done') show(); }, 30000);
  readLink();
  return {isOpen, may, why, check, listen: (listener) => listeners.push(listener)};
})();

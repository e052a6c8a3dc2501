// The page: what the system, the mission and the data report, and orders to the mission.
'use strict';

const $ = (id) => document.getElementById(id);
const state = {system: null, mission: null, missionAt: 0, socket: null, wanted: {}, alerts: [],
  names: {}, heard: 0, questions: new Map()};

// What is shown, by type of data: the first name that fits is taken, unless a better one exists.
const LAYERS = {
  map: {type: 'OccupancyGrid', values: false, hz: 1, show: (message) => showMap(message.name)},
  pose: {type: 'PoseWithCovarianceStamped', hz: 10, show: ({value}) => showPose(value)},
  scan: {type: 'LaserScan', hz: 5, show: ({value}) => RobotMap.setScan({
    stamp: value.stamp, ranges: value.ranges, first: value.angle_min, step: value.angle_increment,
    min: value.range_min, max: value.range_max})},
  path: {type: 'Path', hz: 2, show: ({value}) => RobotMap.setPath(
    value.poses.map((it) => [it.pose.position.x, it.pose.position.y]))},
  camera: {type: 'CompressedImage', values: false, hz: 5, show: (message) => showCamera(message.name)},
  battery: {type: 'BatteryState', hz: 0.5, show: ({value}) => {
    $('battery').textContent = value.percentage >= 0 ? `battery ${Math.round(value.percentage * 100)} %` : '';
  }},
  odometry: {type: 'Odometry', hz: 2, show: ({value}) => {
    const {linear, angular} = value.twist.twist;
    setReading('speed', `${linear.x.toFixed(2)} m/s, ${angular.z.toFixed(2)} rad/s`);
  }},
  progress: {type: 'Progress', hz: 1, many: true, show: ({name, value}) => {
    const share = value.task && value.fraction >= 0 ? ` ${Math.round(value.fraction * 100)} %` : '';
    const detail = value.task && value.detail ? `, ${value.detail}` : '';
    setReading(name.split('.')[0], `${value.task || '–'}${share}${detail}`);
  }},
};

function make(tag, text, properties = {}) {
  const element = Object.assign(document.createElement(tag), properties);
  element.textContent = text;
  return element;
}

function setReading(name, text) {
  let value = document.querySelector(`#values [data-name="${CSS.escape(name)}"]`);
  if (!value) {
    value = make('dd', '');
    value.dataset.name = name;
    $('values').append(make('dt', name), value);
  }
  value.textContent = text;
}

const duration = (s) => (s < 60 ? `${Math.max(0, s).toFixed(0)} s`
  : `${Math.floor(s / 60)} min ${String(Math.floor(s % 60)).padStart(2, '0')} s`);

// The connection.
const socketUrl = (path) => `${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}${path}`;
function connect() {
  if (!Session.isOpen()) { setTimeout(connect, 1000); return; }
  const socket = new WebSocket(socketUrl('/api/live'));
  state.socket = socket;
  socket.onopen = () => {
    state.wanted = {};
    socket.send(JSON.stringify({subscribe: [{name: 'system', max_hz: 2}, {name: 'mission', max_hz: 5}]}));
  };
  socket.onmessage = (event) => {
    state.heard = Date.now();
    handleMessage(JSON.parse(event.data));
  };
  socket.onclose = () => {
    setTimeout(connect, 1000);
    showLink();
    // The session may have ended.
    Session.check();
  };
}

function handleMessage(message) {
  if (message.name === 'system') return showSystem(message.value);
  if (message.name === 'mission') return showMission(message.value);
  if (message.problem || message.error) return undefined;
  const layer = Object.values(LAYERS).find((it) => it.type === message.type);
  return layer && layer.show(message);
}

// Subscribes to what the processes of the system provide.
function chooseData(system) {
  const outputs = system.processes.flatMap((process) => process.outputs);
  const subscribe = [];
  for (const [layer, {type, hz, values = true, many}] of Object.entries(LAYERS)) {
    const names = outputs.filter((it) => it.type === type).map((it) => it.data);
    const better = names.filter((name) => name.endsWith(`.${layer}`));
    const chosen = many ? names : [better[0] || names[0]].filter(Boolean);
    for (const name of chosen) {
      if (state.wanted[name]) continue;
      state.wanted[name] = layer;
      subscribe.push({name, max_hz: hz, values});
    }
  }
  if (subscribe.length && state.socket.readyState === WebSocket.OPEN) {
    state.socket.send(JSON.stringify({subscribe}));
  }
}

const fetching = new Set();
async function fetchImage(name, show) {
  // A slow network gets fewer images, and never two of the same name at the same time.
  if (fetching.has(name) || document.hidden) return;
  fetching.add(name);
  try {
    const response = await fetch(`/api/data/${name}/image`);
    if (response.ok) await show(await response.blob(), JSON.parse(response.headers.get('armor-place')));
  } catch { /* The next arrival tries again. */ } finally {
    fetching.delete(name);
  }
}
const showMap = (name) => fetchImage(name, async (blob, place) =>
  RobotMap.setMap(await createImageBitmap(blob), place));
const showCamera = (name) => fetchImage(name, (blob) => {
  const before = $('camera').src;
  $('camera').src = URL.createObjectURL(blob);
  $('camera').hidden = false;
  if (before) URL.revokeObjectURL(before);
});
$('camera').addEventListener('click', () => $('camera').classList.toggle('large'));

function showPose(value) {
  const {position, orientation} = value.pose.pose;
  const yaw = 2 * Math.atan2(orientation.z, orientation.w);
  RobotMap.setPose({x: position.x, y: position.y, yaw, stamp: value.stamp});
  setReading('place', `${position.x.toFixed(2)} m, ${position.y.toFixed(2)} m, ${Math.round(yaw * 180 / Math.PI)}°`);
}

// The system.
function showSystem(system) {
  const before = state.system;
  state.system = system;
  chooseData(system);
  showLink();
  for (const process of system.processes) {
    const last = before && before.processes.find((it) => it.name === process.name);
    const isBad = ['dead', 'failed', 'suspected', 'restarting'].includes(process.state);
    if (isBad && (!last || last.state !== process.state)) {
      const because = process.problem || process.last_error;
      addAlert(`${process.name} is ${process.state}${because ? `: ${because}` : ''}`);
    }
    if (last && process.starts > last.starts) addAlert(`${process.name} was started again`);
    if (process.hangs && !(last && last.hangs)) addAlert(`${process.name} is ${process.call}`);
  }
  const rows = system.processes.map((it) => row([it.name, it.state, it.starts,
    it.problem || it.call || it.last_error], it.state));
  $('process-rows').replaceChildren(...rows);
  $('link-rows').replaceChildren(...system.links.map((it) => row([it.from, it.to,
    it.rate_hz === null ? '' : it.rate_hz.toFixed(1), it.lost, it.dropped],
  it.connected ? 'active' : 'failed')));
  const down = system.links.filter((it) => !it.connected).length;
  const bad = system.processes.filter((it) => ['dead', 'failed', 'suspected'].includes(it.state)).length;
  $('health').textContent = down || bad ? `${bad} failing, ${down} links down` : 'all well';
  $('health').className = down || bad ? 'bad' : 'quiet';
  showBanner();
}

function row(cells, mark) {
  const line = make('tr', '');
  line.dataset.state = mark;
  line.append(...cells.map((cell) => make('td', String(cell ?? ''))));
  return line;
}

function showLink() {
  const isOpen = state.socket && state.socket.readyState === WebSocket.OPEN;
  const isFound = isOpen && state.system && state.system.found;
  $('link').dataset.state = isFound ? 'good' : 'bad';
  $('link').title = isFound ? 'connected' : isOpen ? 'no system' : 'not connected';
  if (!isFound) RobotMap.clear();
  showBanner();
}

function showBanner() {
  const {system, mission} = state;
  const marking = mission && mission.marking;
  const isOpen = state.socket && state.socket.readyState === WebSocket.OPEN;
  const isStopped = Boolean(system && system.stop.ordered);
  let text = '';
  if (!isOpen) text = 'Not connected: what is shown is old. The robot may be moving.';
  else if (system && system.ended) text = 'The system has ended.';
  else if (system && !system.found) text = 'The registry of the system does not answer.';
  else if (isStopped) text = `STOP is in force${system.stop.means === 'paused' ? ': the mission is paused' : ''}.`;
  else if (marking && marking.pause) text = `PAUSED by ${marking.pause.by}. Components in no marked place still run.`;
  else if (marking && marking.why) text = marking.why;
  $('banner-text').textContent = text;
  $('banner').hidden = !text;
  $('banner').dataset.kind = isStopped || !isOpen ? 'stop' : 'note';
  Drive.setStopped(isStopped);
}

// The mission.
function showMission(mission) {
  const before = state.mission && state.mission.marking;
  // An earlier time: this is another run.
  if (state.mission && mission.now_at_s < state.mission.now_at_s - 1) RobotMap.reset();
  state.mission = mission;
  state.missionAt = Date.now();
  const {marking} = mission;
  if (!marking) {
    $('stage').textContent = 'no mission';
    $('places').replaceChildren(make('p', mission.problem || 'no mission', {className: 'quiet'}));
    return;
  }
  $('robot').textContent = marking.mission;
  $('stage').textContent = marking.stage;
  $('stage').dataset.stage = marking.stage;
  if (before && before.stage !== marking.stage && ['failed', 'safe', 'retreating'].includes(marking.stage)) {
    addAlert(`the mission is ${marking.stage}${marking.why ? `: ${marking.why}` : ''}`);
  }
  $('places').replaceChildren(...marking.places.map((it) => make('span',
    it.place + (it.tokens > 1 ? ` × ${it.tokens}` : '') + (it.active ? '' : ` (waits for ${it.waits_for.join(', ') || 'it'})`),
    {className: 'place'})), ...marking.in_flight.map((it) => make('span', `${it.cause} …`, {className: 'place quiet'})));
  $('history').replaceChildren(...marking.history.slice(-8).reverse()
    .map((it) => make('li', `${duration(it.fired_at_s)}  ${it.transition}`)));
  showQuestions(marking);
  showEnabled(marking);
  showBanner();
}

const missionNow = () => {
  const {marking} = state.mission;
  const runs = !['goal', 'safe', 'failed', 'paused'].includes(marking.stage);
  return state.mission.now_at_s + (runs ? (Date.now() - state.missionAt) / 1000 : 0);
};

// A question stays the same element, so that a click begun before does not hit a new one.
function showQuestions(marking) {
  const asked = new Set(marking.confirmations.map((it) => it.transition));
  for (const [name, element] of state.questions) {
    if (!asked.has(name)) { element.remove(); state.questions.delete(name); }
  }
  for (const question of marking.confirmations) {
    if (state.questions.has(question.transition)) continue;
    const element = make('div', '', {className: 'question'});
    element.dataset.transition = question.transition;
    const buttons = [['Confirm', 'confirm'], ['Decline', 'decline']].map(([label, order]) => {
      const button = make('button', label, {disabled: true});
      button.addEventListener('click', () => giveOrder({order, transition: question.transition}));
      button.title = Session.why('operator');
      setTimeout(() => { button.disabled = !Session.may('operator'); }, 500);
      return button;
    });
    const left = make('span', '', {className: 'quiet'});
    element.append(make('strong', `${question.transition}?`), ...buttons, left);
    $('questions').append(element);
    state.questions.set(question.transition, element);
    addAlert(`the mission asks: ${question.transition}?`);
  }
}

function showEnabled(marking) {
  const rows = marking.enabled.map((it) => {
    const line = make('li', it.transition);
    const now = missionNow();
    const when = it.earliest_at_s > now ? ` in ${duration(it.earliest_at_s - now)}` : ' now';
    if (it.by === 'operator') {
      const button = make('button', 'Fire', {
        disabled: it.earliest_at_s > now || !Session.may('operator'), title: Session.why('operator')});
      button.addEventListener('click', () => giveOrder({order: 'fire', transition: it.transition}));
      line.append(' ', button);
    } else {
      line.append(make('span', `${when}${it.by === 'mission' ? '' : `, ${it.by}`}`, {className: 'quiet'}));
    }
    return line;
  });
  const waiting = marking.waiting.map((it) => {
    const what = it.report || it.hindrance || (it.guard ? 'its guard' : '');
    const line = make('li', it.transition, {className: 'quiet'});
    line.append(make('span', ` waits for ${what}`));
    return line;
  });
  $('enabled').replaceChildren(...rows, ...waiting);
}

async function giveOrder(order) {
  $('order-answer').textContent = '…';
  let answer;
  try {
    const response = await fetch('/api/mission/orders', {method: 'POST',
      headers: {'Content-Type': 'application/json'}, body: JSON.stringify(order)});
    answer = await response.json();
  } catch {
    $('order-answer').textContent = 'The order was not sent: no connection.';
    return;
  }
  $('order-answer').textContent = answer.error ? answer.error.what : answer.text;
  if (answer.error && answer.error.what.endsWith('take it over') && !order.take) {
    const button = make('button', 'Take the command over');
    button.addEventListener('click', () => giveOrder({...order, take: true}));
    $('order-answer').append(' ', button);
  }
}
document.querySelectorAll('[data-order]').forEach((button) =>
  button.addEventListener('click', () => giveOrder({order: button.dataset.order})));

// What the role does not allow is shown as such.
function showRole() {
  const resume = document.querySelector('[data-order=resume]');
  resume.disabled = !Session.may('operator');
  resume.title = Session.why('operator');
  for (const element of state.questions.values()) element.remove();
  state.questions.clear();
  if (state.mission) showMission(state.mission);
  if (Session.isOpen()) findLaser();
}
Session.listen(showRole);

// Alerts stay until a person acknowledges them.
function addAlert(text) {
  state.alerts.unshift({text, at: new Date()});
  state.alerts.length = Math.min(state.alerts.length, 100);
  showAlerts();
}
function showAlerts() {
  const count = state.alerts.length;
  $('alert-count').hidden = $('acknowledge').hidden = !count;
  $('alert-count').textContent = count === 1 ? '1 alert' : `${count} alerts`;
  const lines = state.alerts.map(({text, at}) => make('li', `${at.toLocaleTimeString()}  ${text}`));
  $('alert-list').replaceChildren(...(count ? lines : [make('li', 'none', {className: 'quiet'})]));
}
$('acknowledge').addEventListener('click', () => { state.alerts = []; showAlerts(); });

// On a phone the banner stays beneath the header, which may have two lines.
const header = document.querySelector('header');
new ResizeObserver(() => document.documentElement.style.setProperty('--head', `${header.offsetHeight}px`))
  .observe(header);

// The theme.
function setTheme(theme) {
  document.documentElement.dataset.theme = theme;
  $('theme').textContent = theme === 'dark' ? 'light' : 'dark';
  localStorage.setItem('theme', theme);
  RobotMap.request();
}
$('theme').addEventListener('click', () =>
  setTheme(document.documentElement.dataset.theme === 'dark' ? 'light' : 'dark'));
setTheme(localStorage.getItem('theme')
  || (matchMedia('(prefers-color-scheme: light)').matches ? 'light' : 'dark'));

// Where the laser is on the robot, as the file specifies it.
async function findLaser() {
  try {
    const {parameters} = await (await fetch('/api/parameters')).json();
    const frames = parameters.find((it) => it.name === 'frames' && it.value);
    const laser = frames && frames.value.split(/[\s;]+/).map((it) => it.split(','))
      .find(([name]) => name === 'laser');
    if (laser) RobotMap.setLaser({x: Number(laser[2]), y: Number(laser[3]), yaw: Number(laser[7])});
  } catch { /* The scan is drawn at the robot's centre. */ }
}

setInterval(() => {
  const marking = state.mission && state.mission.marking;
  $('clock').textContent = marking ? duration(missionNow()) : '';
  for (const [name, element] of state.questions) {
    const question = marking && marking.confirmations.find((it) => it.transition === name);
    const by = question && question.answer_by_at_s;
    element.lastChild.textContent = by === null || by === undefined ? ''
      : `${question.unanswered === 'fire' ? 'fires' : 'is declined'} in ${duration(by - missionNow())}`;
  }
}, 500);

connect();
findLaser();
if ('serviceWorker' in navigator) navigator.serviceWorker.register('/sw.js').catch(() => {});

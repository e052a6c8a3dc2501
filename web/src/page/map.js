// The map with the robot, its scan and its path.
'use strict';

const RobotMap = (() => {
  const canvas = document.getElementById('map');
  const context = canvas.getContext('2d');
  const note = document.getElementById('map-note');
  const shown = {map: null, pose: null, scan: null, path: null, laser: {x: 0, y: 0, yaw: 0}};
  const track = [];
  const poses = [];
  let view = null;
  let follows = false;
  let isDue = false;

  function colour(name) {
    return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  }

  function fit() {
    const {width, height} = canvas;
    if (!shown.map || !width) return;
    const {place} = shown.map;
    const [w, h] = [place.width * place.resolution_m, place.height * place.resolution_m];
    const scale = Math.min(width / w, height / h) * 0.94;
    const middle = {x: place.origin.x_m + w / 2, y: place.origin.y_m + h / 2};
    view = {scale, x: middle.x, y: middle.y, isFitted: true};
    request();
  }

  function request() {
    if (isDue) return;
    isDue = true;
    requestAnimationFrame(draw);
  }

  function resize() {
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth * ratio, canvas.clientHeight * ratio].map(Math.round);
    if (canvas.width !== width || canvas.height !== height) {
      canvas.width = width;
      canvas.height = height;
      if (!view || view.isFitted) fit();
    }
    request();
  }

  const toScreen = (x, y) => [
    canvas.width / 2 + (x - view.x) * view.scale, canvas.height / 2 - (y - view.y) * view.scale];

  function draw() {
    isDue = false;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, canvas.width, canvas.height);
    if (!view) return;
    if (follows && shown.pose) [view.x, view.y] = [shown.pose.x, shown.pose.y];
    if (shown.map) drawMap(shown.map);
    drawLine(shown.path, colour('--path'), 2);
    drawLine(track, colour('--track'), 2);
    if (shown.pose) {
      drawScan();
      drawRobot(shown.pose);
    }
  }

  function drawMap({bitmap, place}) {
    const {origin, resolution_m: side} = place;
    const [x, y] = toScreen(origin.x_m, origin.y_m);
    context.save();
    context.imageSmoothingEnabled = false;
    context.translate(x, y);
    context.rotate(-origin.yaw_rad);
    const [width, height] = [place.width, place.height].map((cells) => cells * side * view.scale);
    context.globalAlpha = Number(colour('--map-alpha')) || 1;
    context.drawImage(bitmap, 0, -height, width, height);
    context.restore();
  }

  function drawLine(points, style, width) {
    if (!points || points.length < 2) return;
    context.strokeStyle = style;
    context.lineWidth = width * (window.devicePixelRatio || 1);
    context.beginPath();
    points.forEach(([x, y], index) => {
      const at = toScreen(x, y);
      if (index) context.lineTo(...at); else context.moveTo(...at);
    });
    context.stroke();
  }

  function drawScan() {
    const {scan, laser} = shown;
    if (!scan) return;
    // A pose belongs to the time of a scan, and arrives after it.
    const age = (it) => Math.abs(it.stamp - scan.stamp);
    const pose = poses.reduce((best, it) => (age(it) < age(best) ? it : best), shown.pose);
    const yaw = pose.yaw + laser.yaw;
    const [cos, sin] = [Math.cos(pose.yaw), Math.sin(pose.yaw)];
    const x0 = pose.x + cos * laser.x - sin * laser.y;
    const y0 = pose.y + sin * laser.x + cos * laser.y;
    context.fillStyle = colour('--scan');
    const size = 2 * (window.devicePixelRatio || 1);
    scan.ranges.forEach((range, index) => {
      if (typeof range !== 'number' || range < scan.min || range > scan.max) return;
      const angle = yaw + scan.first + index * scan.step;
      const [x, y] = toScreen(x0 + range * Math.cos(angle), y0 + range * Math.sin(angle));
      context.fillRect(x - size / 2, y - size / 2, size, size);
    });
  }

  function drawRobot({x, y, yaw}) {
    const radius = Math.max(0.18 * view.scale, 7 * (window.devicePixelRatio || 1));
    context.save();
    context.translate(...toScreen(x, y));
    context.rotate(-yaw);
    context.fillStyle = colour('--robot');
    context.strokeStyle = colour('--panel');
    context.lineWidth = 2;
    context.beginPath();
    context.moveTo(radius * 1.3, 0);
    context.lineTo(-radius * 0.9, radius * 0.85);
    context.lineTo(-radius * 0.5, 0);
    context.lineTo(-radius * 0.9, -radius * 0.85);
    context.closePath();
    context.fill();
    context.stroke();
    context.restore();
  }

  function zoom(factor, x = canvas.width / 2, y = canvas.height / 2) {
    if (!view) return;
    const before = [view.x + (x - canvas.width / 2) / view.scale,
      view.y - (y - canvas.height / 2) / view.scale];
    view.scale = Math.min(Math.max(view.scale * factor, 2), 2000);
    view.x = before[0] - (x - canvas.width / 2) / view.scale;
    view.y = before[1] + (y - canvas.height / 2) / view.scale;
    view.isFitted = false;
    request();
  }

  const held = new Map();
  canvas.addEventListener('pointerdown', (event) => {
    canvas.setPointerCapture(event.pointerId);
    held.set(event.pointerId, [event.clientX, event.clientY]);
  });
  canvas.addEventListener('pointermove', (event) => {
    const before = held.get(event.pointerId);
    if (!before || !view) return;
    const ratio = window.devicePixelRatio || 1;
    const others = [...held].filter(([id]) => id !== event.pointerId);
    if (others.length) {
      const [x, y] = others[0][1];
      const length = (at) => Math.hypot(at[0] - x, at[1] - y) || 1;
      zoom(length([event.clientX, event.clientY]) / length(before));
    } else {
      view.x -= (event.clientX - before[0]) * ratio / view.scale;
      view.y += (event.clientY - before[1]) * ratio / view.scale;
      view.isFitted = false;
      setFollow(false);
    }
    held.set(event.pointerId, [event.clientX, event.clientY]);
    request();
  });
  ['pointerup', 'pointercancel'].forEach((name) =>
    canvas.addEventListener(name, (event) => held.delete(event.pointerId)));
  canvas.addEventListener('wheel', (event) => {
    event.preventDefault();
    const ratio = window.devicePixelRatio || 1;
    zoom(Math.exp(-event.deltaY / 400), event.offsetX * ratio, event.offsetY * ratio);
  }, {passive: false});

  const followButton = document.getElementById('follow');
  function setFollow(on) {
    follows = on;
    followButton.setAttribute('aria-pressed', String(on));
    request();
  }
  followButton.addEventListener('click', () => setFollow(!follows));
  document.getElementById('fit').addEventListener('click', () => { setFollow(false); fit(); });
  document.getElementById('zoom-in').addEventListener('click', () => zoom(1.4));
  document.getElementById('zoom-out').addEventListener('click', () => zoom(1 / 1.4));
  new ResizeObserver(resize).observe(canvas);

  function setMap(bitmap, place) {
    const before = shown.map && shown.map.place;
    if (before && before.frame !== place.frame) track.length = 0;
    if (shown.map) shown.map.bitmap.close();
    shown.map = {bitmap, place};
    note.hidden = true;
    if (!view || view.isFitted) fit();
    request();
  }

  function setPose(pose) {
    shown.pose = pose;
    poses.push(pose);
    if (poses.length > 30) poses.shift();
    const last = track[track.length - 1];
    if (!last || Math.hypot(pose.x - last[0], pose.y - last[1]) > 0.05) track.push([pose.x, pose.y]);
    if (track.length > 5000) track.shift();
    if (!view) view = {scale: 40, x: pose.x, y: pose.y, isFitted: true};
    request();
  }

  return {
    setMap, setPose, request,
    setPath: (points) => { shown.path = points; request(); },
    setScan: (scan) => { shown.scan = scan; request(); },
    setLaser: (laser) => { shown.laser = laser; request(); },
    reset: () => { track.length = poses.length = 0; shown.scan = shown.path = null; request(); },
    clear: () => { shown.scan = null; shown.path = null; request(); },
  };
})();

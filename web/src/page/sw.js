// Keeps the files of the page, so that it opens without a network and shows what it waits for. Data
// are never kept: an old map would look like the present one.
'use strict';

const CACHE = 'armor-page-2';
const FILES = ['/', '/style.css', '/app.js', '/map.js', '/stop.js', '/drive.js', '/session.js', '/stop.html',
  '/manifest.webmanifest', '/icon.svg'];

self.addEventListener('install', (event) => {
  event.waitUntil(caches.open(CACHE).then((cache) => cache.addAll(FILES))
    .then(() => self.skipWaiting()));
});
self.addEventListener('activate', (event) => {
  event.waitUntil(caches.keys()
    .then((names) => Promise.all(names.filter((name) => name !== CACHE).map((name) => caches.delete(name))))
    .then(() => self.clients.claim()));
});
self.addEventListener('fetch', (event) => {
  const url = new URL(event.request.url);
  if (event.request.method !== 'GET' || url.origin !== location.origin || !FILES.includes(url.pathname)) return;
  // The server first, so that a new version is used as soon as it runs.
  event.respondWith(fetch(event.request)
    .then((response) => {
      const copy = response.clone();
      if (response.ok) caches.open(CACHE).then((cache) => cache.put(url.pathname, copy));
      return response;
    })
    .catch(() => caches.match(url.pathname)));
});

'use strict';
// The servers of `modar web --serve` and `modar studio` under Node, in a thread of its own. The rules of access are those of the
// native program: serve.cpp and server.cpp.
const childProcess = require('child_process');
const crypto = require('crypto');
const fs = require('fs');
const http = require('http');
const https = require('https');
const os = require('os');
const path = require('path');
const { workerData } = require('worker_threads');
const { toSystem } = require('./paths.js');

const { kind, options, wakes, port: program } = workerData;
const TYPES = {
  html: 'text/html; charset=utf-8', css: 'text/css; charset=utf-8', js: 'text/javascript', mjs: 'text/javascript', json: 'application/json',
  svg: 'image/svg+xml', png: 'image/png', jpg: 'image/jpeg', jpeg: 'image/jpeg', webp: 'image/webp', wasm: 'application/wasm',
  woff2: 'font/woff2', mp4: 'video/mp4', webm: 'video/webm', zip: 'application/zip', glb: 'model/gltf-binary', usdz: 'model/vnd.usdz+zip',
  webmanifest: 'application/manifest+json',
};
const MOST_CONNECTIONS = 1024;
const MOST_PATH = 2048;
const MOST_POST_BYTES = 4 * 2 ** 20;
const MOST_UPLOAD_BYTES = 2 ** 31;
const MOST_LISTENERS = 8;
const SILENT_MS = 10_000;
const PAUSE_MS = 1_000;  // after which no more of a refused body is waited for
const MOST_REST_BYTES = 64 * 2 ** 20;  // of a refused body, which are read
const BEAT_MS = 5_000;  // so often a page hears that the studio is there
const SECRET_BYTES = 20;
const VALID_DAYS = 7;

/** Hands a message to the program, which waits for it. */
function tell(message) {
  program.postMessage(message);
  Atomics.add(wakes, 0, 1);
  Atomics.notify(wakes, 0);
}

// ---- files ----

/** The path of a regular file in the folder that the name means; null for hidden ones and links that lead out of it. */
function fileInside(folder, name) {
  try {
    const root = fs.realpathSync(folder);
    const file = fs.realpathSync(path.join(root, name));
    const below = path.relative(root, file);
    const outside = !below || below.startsWith('.') || path.isAbsolute(below);
    return outside || !fs.statSync(file).isFile() ? null : file;
  } catch {
    return null;
  }
}

/** What a request names below the server's root, decoded, and its query; null where it is no address. */
function addressOf(request) {
  const [wanted, query = ''] = request.url.split(/\?(.*)/s, 2);
  try {
    return { name: decodeURIComponent(wanted), query: new URLSearchParams(query) };
  } catch {
    return null;
  }
}

/** The part of a file of that size that a request wants; null: it has no such part. */
function rangeOf(header, size) {
  const [, first, last] = /^bytes=(\d*)-(\d*)$/.exec(header ?? '') ?? [];
  if (first === undefined || (first === '' && last === '')) return { start: 0, end: size - 1, whole: true };
  const start = first === '' ? Math.max(0, size - Number(last)) : Number(first);
  const end = first === '' || last === '' ? size - 1 : Math.min(Number(last), size - 1);
  return start > end ? null : { start, end, whole: false };
}

function sendFile(request, response, file, type) {
  const { size } = fs.statSync(file);
  const range = rangeOf(request.headers.range, size);
  if (!range) {
    response.writeHead(416, { 'Content-Range': `bytes */${size}` }).end();
    return;
  }
  const { start, end, whole } = range;
  response.writeHead(whole ? 200 : 206, {
    'Content-Type': type ?? TYPES[path.extname(file).slice(1).toLowerCase()] ?? 'application/octet-stream',
    'Content-Length': end - start + 1,
    'Accept-Ranges': 'bytes',
    ...(whole ? {} : { 'Content-Range': `bytes ${start}-${end}/${size}` }),
  });
  if (request.method === 'HEAD' || size === 0) response.end();
  else fs.createReadStream(file, { start, end }).on('error', () => response.destroy()).pipe(response);
}

/** Serves on the address; the program learns how, or why not. */
function listen(server, host, number, told) {
  Object.assign(server, { maxConnections: MOST_CONNECTIONS, headersTimeout: SILENT_MS, keepAliveTimeout: SILENT_MS, requestTimeout: 0, timeout: SILENT_MS });
  server.on('error', ({ message }) => tell({ error: message }));
  server.listen(number, host, () => told(server.address().port).then(tell, ({ message }) => tell({ error: message })));
}

// ---- `modar web --serve` ----

const der = (tag, ...parts) => {
  const body = Buffer.concat(parts);
  const length = body.length < 128 ? [body.length] : [0x82, body.length >> 8, body.length & 255];
  return Buffer.concat([Buffer.from([tag, ...length]), body]);
};
const sequence = (...parts) => der(0x30, ...parts);
const identifier = (hex) => der(0x06, Buffer.from(hex, 'hex'));

/** For localhost and the addresses, signed by its own key (X.509, RFC 5280). */
function makeCertificate(addresses) {
  const { privateKey, publicKey } = crypto.generateKeyPairSync('ec', { namedCurve: 'P-256' });
  const time = (ms) => der(0x17, Buffer.from(`${new Date(ms).toISOString().replace(/[-:T]/g, '').slice(2, 14)}Z`));
  const signedBy = sequence(identifier('2a8648ce3d040302'));  // ECDSA with SHA-256
  const name = sequence(der(0x31, sequence(identifier('550403'), der(0x0c, Buffer.from('ModAR on this machine')))));
  const names = sequence(der(0x82, Buffer.from('localhost')),
    ...['127.0.0.1', ...addresses].map((address) => der(0x87, Buffer.from(address.split('.').map(Number)))));
  const body = sequence(
    der(0xa0, der(0x02, Buffer.from([2]))), der(0x02, Buffer.from([1])), signedBy, name,
    sequence(time(Date.now() - 3_600_000), time(Date.now() + VALID_DAYS * 86_400_000)), name,
    publicKey.export({ type: 'spki', format: 'der' }), der(0xa3, sequence(sequence(identifier('551d11'), der(0x04, names)))));
  const signature = crypto.sign('sha256', body, privateKey);
  const whole = sequence(body, signedBy, der(0x03, Buffer.from([0]), signature)).toString('base64').replace(/.{64}/g, '$&\n');
  return { key: privateKey.export({ type: 'pkcs8', format: 'pem' }), cert: `-----BEGIN CERTIFICATE-----\n${whole}\n-----END CERTIFICATE-----\n` };
}

const SITE_HEADERS = {
  'Content-Security-Policy':
    "script-src 'self' 'wasm-unsafe-eval'; base-uri 'none'; object-src 'none'; form-action 'none'; frame-ancestors 'self'",
  'X-Content-Type-Options': 'nosniff',
  'Referrer-Policy': 'no-referrer',
};

/** As block letters, two modules a letter: light ones are drawn, for terminals are dark. */
async function codeOf(text) {
  const { qrOf } = await import(require('url').pathToFileURL(`${__dirname}/../qr.js`).href);
  const rows = qrOf(text);
  const light = (x, y) => !rows[y]?.[x];
  let lines = '';
  for (let y = -2; y < rows.length + 2; y += 2) {
    for (let x = -2; x < rows.length + 2; ++x) lines += ' ▀▄█'[Number(light(x, y)) + 2 * Number(light(x, y + 1))];
    lines += '\n';
  }
  return lines;
}

function serveSite({ folder, bind, port: number }) {
  const own = Object.values(os.networkInterfaces()).flat().filter(({ family, internal }) => family === 'IPv4' && !internal).map(({ address }) => address);
  const addresses = bind === '0.0.0.0' ? own : bind.startsWith('127.') ? [] : [bind];
  const server = https.createServer(makeCertificate(addresses), (request, response) => {
    for (const [name, value] of Object.entries(SITE_HEADERS)) response.setHeader(name, value);
    const name = addressOf(request)?.name ?? '';
    const file = ['GET', 'HEAD'].includes(request.method) && !name.includes('//') && fileInside(toSystem(folder), name.endsWith('/') ? `${name}index.html` : name);
    if (file) sendFile(request, response, file);
    else response.writeHead(404).end();
  });
  listen(server, bind, number, async (real) => {
    const urls = [...addresses, 'localhost'].map((address) => `https://${address}:${real}/`);
    return { urls, code: await codeOf(urls[0]).catch(() => '') };
  });
}

// ---- `modar studio` ----

const STUDIO_HEADERS = {
  'Content-Security-Policy':
    "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self' blob: data:; media-src 'self' blob:; " +
    "worker-src 'self' blob:; connect-src 'self' blob: data:; frame-src 'self'; object-src 'none'; base-uri 'none'; form-action 'none'; " +
    "frame-ancestors 'self'",
  'X-Content-Type-Options': 'nosniff',
  'Referrer-Policy': 'no-referrer',
  'Cross-Origin-Opener-Policy': 'same-origin',
  'Cross-Origin-Resource-Policy': 'same-origin',
  'Permissions-Policy': 'camera=(self), microphone=(), geolocation=()',
  'Cache-Control': 'no-store',
};
const makeSecret = () => crypto.randomBytes(SECRET_BYTES).toString('hex');

class Studio {
  secret = makeSecret();
  host = '';
  openings = new Set();  // addresses that nobody has used yet
  waiting = new Map();   // responses, by the number of their request
  last = 0;
  listeners = new Set();
  events = [];
  job = null;

  openOnce() {
    const word = makeSecret();
    this.openings.add(word);
    return `http://${this.host}/open-${word}`;
  }

  /** Whether the request comes from our page, or opens it. */
  isOurs({ headers, rawHeaders }) {
    const hosts = rawHeaders.filter((name, i) => i % 2 === 0 && name.toLowerCase() === 'host').length;
    const site = headers['sec-fetch-site'] ?? 'none';
    return hosts === 1 && headers.host === this.host && [`http://${this.host}`, undefined].includes(headers.origin) &&
      ['same-origin', 'none'].includes(site);
  }

  hasSecret(pathname) {
    const given = Buffer.from(pathname.slice(0, this.secret.length + 2));
    const right = Buffer.from(`/${this.secret}/`);
    return given.length === right.length && crypto.timingSafeEqual(given, right);
  }

  answer(request, response) {
    for (const [name, value] of Object.entries(STUDIO_HEADERS)) response.setHeader(name, value);
    const refuse = (status) => response.writeHead(status, { 'Content-Type': 'text/plain' })
      .end('the address is not complete: open the one that the studio has shown\n');
    if (request.url.length > MOST_PATH) return refuse(414);
    if (!this.isOurs(request)) return refuse(403);
    const address = addressOf(request);
    if (!address) return refuse(403);
    if (request.method === 'GET' && address.name.startsWith('/open-') && this.openings.delete(address.name.slice(6))) {
      return response.writeHead(303, { Location: `/${this.secret}/` }).end();
    }
    if (!this.hasSecret(address.name)) return refuse(403);
    const name = address.name.slice(this.secret.length + 2);
    const query = Object.fromEntries([...address.query].reverse());  // the first of each name
    const method = request.method === 'HEAD' ? 'GET' : request.method;
    if (!['GET', 'POST', 'PUT', 'DELETE'].includes(method)) return refuse(405);
    if (method === 'GET') return this.get(request, response, name, query);
    const call = { method, path: name, query, body: '' };
    if (method === 'PUT') return this.put(request, response, call);
    return this.post(request, response, call);
  }

  get(request, response, name, query) {
    if (name === 'api/events') return this.listen(request, response);
    if (name === 'api/opening') return response.writeHead(200, { 'Content-Type': 'text/plain' }).end(this.openOnce());
    if (name.startsWith('api/')) return this.ask(request, response, { method: 'GET', path: name, query, body: '' });
    const file = name.startsWith('engine/') ? fileInside(toSystem(options.engine), name.slice(7)) : fileInside(toSystem(options.page), name || 'index.html');
    if (file) return sendFile(request, response, file);
    return this.wrong(response, 404, { error: 'there is no such file', cure: 'reload the page', code: 'studio.unknown' });
  }

  wrong(response, status, told) {
    response.writeHead(status, { 'Content-Type': 'application/json' }).end(JSON.stringify(told));
  }

  ask(request, response, call, after = () => {}) {
    request.socket.setTimeout(0);  // the answer may take a while
    this.waiting.set(++this.last, { request, response, after });
    tell({ id: this.last, request: call });
  }

  answered({ id, status, type, headers, file, body }) {
    const { request, response, after } = this.waiting.get(id);
    this.waiting.delete(id);
    after();
    response.statusCode = status;
    for (const [name, value] of Object.entries(headers)) response.setHeader(name, value);
    if (file) {
      const here = fileInside(path.dirname(toSystem(file)), path.basename(file));
      if (here) return sendFile(request, response, here, type);
      return this.wrong(response, 404, { error: 'the file is gone', cure: 'reload the page', code: 'studio.unknown' });
    }
    return response.setHeader('Content-Type', type).end(Buffer.from(body));
  }

  post(request, response, call) {
    const json = (request.headers['content-type'] ?? '').startsWith('application/json');
    // A form of another page cannot have this type.
    if (call.method === 'POST' && !json) return this.wrong(response, 400, { error: 'the request is not JSON', cure: 'reload the page', code: 'studio.request' });
    const parts = [];
    if (this.bound(request, response, MOST_POST_BYTES, () => {})) return undefined;
    request.on('data', (part) => parts.push(part));
    return request.on('end', () => this.ask(request, response, { ...call, body: Buffer.concat(parts).toString() }));
  }

  /** Answers when the body has ended, pauses or has no end: who still sends would see the connection end in place of the answer. */
  tooLarge(request, response) {
    let rest = MOST_REST_BYTES;
    const answer = () => {
      clearTimeout(pause);
      if (response.writableEnded) return;
      this.wrong(response, 413, { error: 'it is too large', cure: "make it smaller, or copy it into the project's folder yourself", code: 'studio.too-large' });
    };
    const pause = setTimeout(answer, PAUSE_MS);
    response.refused = true;
    response.setHeader('Connection', 'close');
    request.unpipe().removeAllListeners('data').removeAllListeners('end').on('end', answer).on('data', (part) => {
      rest -= part.length;
      if (rest < 0) answer();
      else pause.refresh();
    }).resume();
  }

  /** Refuses a body of more bytes, as soon as it says so or comes. */
  bound(request, response, most, refused) {
    let bytes = Number(request.headers['content-length'] ?? 0);
    const look = () => {
      if (bytes <= most) return false;
      this.tooLarge(request, response);
      refused();
      return true;
    };
    if (look()) return true;
    bytes = 0;
    request.on('data', (part) => {
      bytes += part.length;
      look();
    });
    return false;
  }

  put(request, response, call) {
    const file = path.join(toSystem(options.own), `incoming-${makeSecret()}`);
    const remove = () => fs.rmSync(file, { force: true });
    const writing = fs.createWriteStream(file, { mode: 0o600, flags: 'wx' });
    request.on('close', () => request.complete || writing.destroy(new Error('the page went away')));
    writing.on('error', ({ message }) => {
      remove();
      if (!response.refused && !response.writableEnded) this.wrong(response, 500, { error: `the file cannot be saved: ${message}`, cure: 'check the disk', code: 'io.write' });
    });
    writing.on('close', () => writing.errored || this.ask(request, response, { ...call, upload: file.replaceAll('\\', '/') }, remove));
    if (!this.bound(request, response, MOST_UPLOAD_BYTES, () => writing.destroy(new Error('it is too large')))) request.pipe(writing);
  }

  // ---- events ----

  listen(request, response) {
    if (this.listeners.size >= MOST_LISTENERS) {
      return this.wrong(response, 503, { error: 'too many pages of this studio are open', cure: 'close some', code: 'studio.unavailable' });
    }
    response.writeHead(200, { 'Content-Type': 'text/event-stream' }).write(':\n\n');
    const since = Number(request.headers['last-event-id'] ?? this.events.at(-1)?.number ?? 0);
    this.listeners.add(response);
    request.on('close', () => this.listeners.delete(response));
    return this.write(response, this.events.filter(({ number }) => number > since));
  }

  write(response, events) {
    for (const { number, name, data } of events) response.write(`id: ${number}\nevent: ${name}\ndata: ${data}\n\n`);
  }

  publish(events) {
    this.events = [...this.events, ...events].slice(-256);
    for (const each of this.listeners) this.write(each, events);
  }

  // ---- jobs ----

  start({ number, kind: what, request }) {
    const child = childProcess.spawn(process.execPath, [`${__dirname}/modar`, 'studio', toSystem(options.folder)], {
      env: { ...process.env, MODAR_STUDIO_JOB: JSON.stringify({ number, request }) }, stdio: ['ignore', 'pipe', 'ignore'],
    });
    this.job = { number, child };
    let ended = false;
    require('readline').createInterface({ input: child.stdout }).on('line', (line) => {
      const told = JSON.parse(line);
      ended ||= told.ended;
      tell(told);
    }).on('close', () => ended || tell({ number, gone: { kind: what, cause: 'its process ended early' } }));
  }

  stop(number) {
    if (this.job?.number === number) this.job.child.kill();
  }
}

/** The page's address of a studio that has this folder open already; null where none answers. */
function openElsewhere(file) {
  return new Promise((resolve) => {
    let address = '';
    try { address = fs.readFileSync(file, 'utf8'); } catch { /* none was open */ }
    if (!/^http:\/\/127\.0\.0\.1:\d+\/\w+\/$/.test(address)) return resolve(null);
    return http.get(`${address}api/opening`, { timeout: SILENT_MS }, (response) => {
      let text = '';
      response.on('data', (part) => { text += part; });
      response.on('end', () => resolve(response.statusCode === 200 ? { page: address, opening: text, elsewhere: true } : null));
    }).on('error', () => resolve(null));
  });
}

async function serveStudio() {
  const file = path.join(toSystem(options.own), 'address');
  const other = await openElsewhere(file);
  if (other) {
    tell(other);
    process.exit();
  }
  const studio = new Studio();
  const server = http.createServer((request, response) => studio.answer(request, response));
  setInterval(() => studio.listeners.forEach((each) => each.write(':\n\n')), BEAT_MS);
  program.on('message', ({ events, start, stop, quit, ...done }) => {
    if (done.id !== undefined) studio.answered(done);
    if (events) studio.publish(events);
    if (start) studio.start(start);
    if (stop !== undefined) studio.stop(stop);
    if (quit) setTimeout(() => { Atomics.add(wakes, 0, 1); Atomics.notify(wakes, 0); }, 100);
  });
  listen(server, '127.0.0.1', options.port, async (real) => {
    studio.host = `127.0.0.1:${real}`;
    const page = `http://${studio.host}/${studio.secret}/`;
    fs.rmSync(file, { force: true });
    fs.writeFileSync(file, page, { mode: 0o600, flag: 'wx' });
    return { page, opening: studio.openOnce() };
  });
}

// The program waits and cannot see it; the server continues.
process.on('uncaughtException', (error) => fs.writeSync(2, `modar: error: the server: ${error.stack}; please report it with what you did\n`));
if (kind === 'site') serveSite(options);
else serveStudio();

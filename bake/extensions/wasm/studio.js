'use strict';
// The program's side of `modar studio` and `modar web --serve` under Node: the server runs in a thread of its own (server.js), and this
// thread, which has the program, waits for its requests. A job of the studio is a second process.
const realFiles = require('fs');
const { Worker, MessageChannel, receiveMessageOnPort } = require('worker_threads');

/** So often the project's folder is looked at for changes by other editors; at most one part in REST of the time is spent on it. */
const LOOK_MS = 250;
const REST = 20;

/** main: emscripten's Module; memory: its functions for texts, its heap, and the files that the program writes to. */
module.exports = (main, { allocateUTF8, UTF8ToString, heap, free, files }) => {
  let server = null;
  let port = null;
  const wakes = new Int32Array(new SharedArrayBuffer(4));
  let over = false;
  let lastEvent = 0;
  let asked = null;  // the request that is being answered
  let job = null;

  /** Calls what the program exports, with texts and numbers; answers text. */
  const call = (name, ...values) => {
    const given = values.map((value) => (typeof value === 'string' ? allocateUTF8(value) : value));
    const answer = main[`_${name}`](...given);
    given.forEach((pointer, i) => typeof values[i] === 'string' && free(pointer));
    return answer ? UTF8ToString(answer) : '';
  };

  const newEvents = () => {
    const events = JSON.parse(call('studio_events', lastEvent));
    if (events.length) lastEvent = events.at(-1).number;
    return events;
  };

  /** Starts the server, and answers what it says first. */
  function open(kind, options) {
    const channel = new MessageChannel();
    port = channel.port1;
    server = new Worker(`${__dirname}/server.js`, { workerData: { kind, options, wakes, port: channel.port2 }, transferList: [channel.port2] });
    for (;;) {
      const seen = Atomics.load(wakes, 0);
      const told = receiveMessageOnPort(port);
      if (told) return told.message;
      Atomics.wait(wakes, 0, seen);
    }
  }

  function wait() {
    for (;;) Atomics.wait(wakes, 0, Atomics.load(wakes, 0));
  }

  function answer(id, request) {
    asked = request;
    const { at, size, ...rest } = JSON.parse(call('studio_call', JSON.stringify(request)));
    port.postMessage({ id, ...rest, body: rest.file ? null : heap().slice(at, at + size) });
    asked = null;
  }

  /** Of the job's process: events that it has published, and the scenes that the project had when it began. */
  function told({ number, events = [], scenes, ended, gone }) {
    if (!job || job.number !== number) return;
    if (scenes) call('studio_set_scenes', scenes);
    if (ended || gone) {
      job.ended = true;
      call('studio_job_ended');
    }
    for (const { name, data } of events) call('studio_publish', name, data);
    if (!gone) return;
    call('studio_publish', 'failed', JSON.stringify({
      job: number, kind: gone.kind, error: `the work ended: ${gone.cause}`, code: 'studio.memory', errors: [],
      cure: 'Node has 4 GB at most for it: use smaller models, or a tier',
    }));
  }

  function serve() {
    let nextLook = 0;
    while (!over) {
      const seen = Atomics.load(wakes, 0);
      for (let got = receiveMessageOnPort(port); got; got = receiveMessageOnPort(port)) {
        if (got.message.request) answer(got.message.id, got.message.request);
        else told(got.message);
      }
      const now = Date.now();
      if (now >= nextLook) {
        call('studio_look');
        nextLook = Date.now() + Math.max(LOOK_MS, REST * (Date.now() - now));
      }
      const events = newEvents();
      if (events.length) port.postMessage({ events });
      if (!over) Atomics.wait(wakes, 0, seen, LOOK_MS);
    }
    port.postMessage({ quit: true, events: newEvents() });
    Atomics.wait(wakes, 0, Atomics.load(wakes, 0), 1000);  // the last answer leaves
  }

  function startJob(number, kind) {
    job = { number, kind, ended: false };
    port.postMessage({ start: { number, kind, request: asked } });
  }

  function endJob() {
    if (!job) return;
    const { number, kind, ended } = job;
    job = null;
    port.postMessage({ stop: number });
    if (!ended) call('studio_publish', 'cancelled', JSON.stringify({ job: number, kind }));
  }

  /** This process is a job: what the program prints is read by its own code, and its events go to stdout. */
  function runJob(folder, text) {
    const { number, request } = JSON.parse(text);
    const rest = ['', '', ''];
    const parent = process.ppid;
    const tell = (ended) => {
      if (process.ppid !== parent) process.exit();  // the studio was ended
      realFiles.writeSync(1, `${JSON.stringify({ number, events: newEvents(), scenes: call('studio_scenes'), ended })}\n`);
    };
    const write = files.writeSync;
    files.writeSync = (descriptor, bytes, offset, length, ...more) => {
      if (descriptor !== 1 && descriptor !== 2) return write(descriptor, bytes, offset, length, ...more);
      const lines = (rest[descriptor] + Buffer.from(bytes.buffer, bytes.byteOffset + offset, length).toString()).split('\n');
      rest[descriptor] = lines.pop();
      for (const line of lines) call('studio_line', descriptor, line);
      if (lines.length && descriptor === 2) tell(false);
      return length;
    };
    call('studio_open', folder, number);
    call('studio_call', JSON.stringify(request));
    tell(true);
  }

  return { open, wait, serve, startJob, endJob, runJob, quit: () => { over = true; } };
};

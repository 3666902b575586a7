// Orders the functions of a WebAssembly module so that those with bytes in common are next to each other, where compression
// finds them: order.cjs MODULE.wasm MODULE.wat reads both forms of it and rewrites the text, which wasm-opt assembles.
const { readFileSync, writeFileSync } = require('fs');

/** Bytes that two functions have in common. Fewer find chance, more miss short idioms. */
const SHINGLE = 5;
/** Functions that have a shingle in common at most: what all have tells nothing, and takes time. */
const MOST = 40;
/** Bytes before a function that count: compression looks back 32 KB. */
const WINDOW = 24000;

/** The bodies in a module's code section. */
function bodiesOf(bytes) {
  let at = 8;
  const number = () => {
    let value = 0;
    for (let shift = 0; ; shift += 7) {
      const byte = bytes[at++];
      value += (byte & 127) * 2 ** shift;
      if (byte < 128) return value;
    }
  };
  while (at < bytes.length) {
    const section = bytes[at++];
    const end = number() + at;
    if (section === 10) {
      const count = number();
      return Array.from({ length: count }, () => {
        const size = number();
        at += size;
        return bytes.subarray(at - size, at);
      });
    }
    at = end;
  }
  return [];
}

/** The shingles that functions have in common: of each shingle its functions, and of each function its shingles. */
function sharedShingles(bodies) {
  const all = new Map();
  bodies.forEach((body, i) => {
    for (let at = 0; at + SHINGLE <= body.length; ++at) {
      const shingle = body.latin1Slice(at, at + SHINGLE);
      const users = all.get(shingle);
      if (!users) all.set(shingle, [i]);
      else if (users[users.length - 1] !== i) users.push(i);
    }
  });
  const users = [...all.values()].filter(({ length }) => length > 1 && length <= MOST);
  const shingles = bodies.map(() => []);
  users.forEach((list, shingle) => list.forEach((i) => shingles[i].push(shingle)));
  return { users, shingles };
}

/** After the largest function, the one with the greatest share of its shingles in the window before it, and so on. */
function orderOf(bodies) {
  const { users, shingles } = sharedShingles(bodies);
  const inWindow = new Uint16Array(users.length);
  const shared = new Int32Array(bodies.length);
  const left = new Set(bodies.keys());
  const order = [];
  let [first, size] = [0, 0];
  const count = (i, by) => {
    size += by * bodies[i].length;
    for (const shingle of shingles[i]) {
      const before = inWindow[shingle];
      inWindow[shingle] += by;
      if ((before > 0) !== (inWindow[shingle] > 0)) for (const k of users[shingle]) shared[k] += by;
    }
  };
  const share = (i) => shared[i] / (shingles[i].length + 8);
  let next = bodies.reduce((largest, body, i) => (body.length > bodies[largest].length ? i : largest), 0);
  while (left.delete(next)) {
    order.push(next);
    count(next, 1);
    while (size > WINDOW && first + 1 < order.length) count(order[first++], -1);
    [next] = left;
    for (const i of left) if (share(i) > share(next)) next = i;
  }
  return order;
}

const [module_, text] = process.argv.slice(2);
const FUNCTION = /^ \(func [^]*?\n \)\n/gm;
const wat = readFileSync(text, 'utf8');
const functions = wat.match(FUNCTION);
const order = orderOf(bodiesOf(readFileSync(module_)));
if (functions.length !== order.length) throw new Error(`${text}: ${functions.length} functions, ${module_}: ${order.length}`);
let at = 0;
writeFileSync(text, wat.replace(FUNCTION, () => functions[order[at++]]));

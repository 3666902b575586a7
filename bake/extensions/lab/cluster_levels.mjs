// An experiment: one hierarchy of clusters in place of levels of chunks and proxies.
//   npm install meshoptimizer@1.3.0
//   MODAR_BIN=build/release/bin node bake/extensions/lab/cluster_levels.mjs MODEL.obj...
// Prints a row of Markdown for each level of the default bake.
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, readdirSync, rmSync, statSync, symlinkSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { basename, dirname, join, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';

const { MeshoptSimplifier: simplifier } =
  await import(pathToFileURL(resolve('node_modules/meshoptimizer/index.js')));
const BIN = process.env.MODAR_BIN ?? 'build/release/bin';
const CLUSTER = Number(process.env.CLUSTER ?? 8192); // triangles, at most
const KEEP = Number(process.env.KEEP ?? 0.25); // of a group's triangles
const GROUP = 4; // clusters
const LAST = 500; // triangles of the coarsest
const WEIGHTS = [0.5, 0.5, 0.5, 0.5, 0.5, 1, 1, 1]; // of normals, uvs, colours
const A = WEIGHTS.length;

/// A mesh: positions (3 a vertex), attributes (A a vertex), indices.
const empty = (vertices, indices) => ({
  p: new Float32Array(3 * vertices), a: new Float32Array(A * vertices), i: new Uint32Array(indices),
});

/// Meshes of an OBJ file, one a material. What it lacks of normals is computed.
function read(path) {
  const v = [], t = [], n = [], c = [];
  const header = [], materials = new Map();
  let faces = null;
  const use = (name) => {
    if (!materials.has(name)) materials.set(name, []);
    faces = materials.get(name);
  };
  use('');
  for (const line of readFileSync(path, 'utf8').split('\n')) {
    const w = line.trim().split(/\s+/);
    if (w[0] === 'v') {
      v.push(+w[1], +w[2], +w[3]);
      c.push(w.length > 6 ? +w[4] : 1, w.length > 6 ? +w[5] : 1, w.length > 6 ? +w[6] : 1);
    } else if (w[0] === 'vt') t.push(+w[1], +(w[2] ?? 0));
    else if (w[0] === 'vn') n.push(+w[1], +w[2], +w[3]);
    else if (w[0] === 'mtllib') header.push(line.trim());
    else if (w[0] === 'usemtl') use(w.slice(1).join(' '));
    else if (w[0] === 'f') {
      const corners = w.slice(1).map((word) => {
        const [a, b, d] = word.split('/').map((x) => (x ? +x : 0));
        const at = (x, size) => (x < 0 ? size + x : x - 1);
        return [at(a, v.length / 3), b ? at(b, t.length / 2) : -1, d ? at(d, n.length / 3) : -1];
      });
      for (let k = 2; k < corners.length; ++k) faces.push(corners[0], corners[k - 1], corners[k]);
    }
  }
  const middle = [0, 1, 2].map((k) => {
    let low = Infinity, high = -Infinity;
    for (let x = k; x < v.length; x += 3) { low = Math.min(low, v[x]); high = Math.max(high, v[x]); }
    return [(low + high) / 2, high - low];
  });
  const scale = 2 / Math.max(...middle.map((m) => m[1]));
  const smooth = n.length === 0 ? normals(v, [...materials.values()]) : null;
  const meshes = [];
  for (const [material, corners] of materials) {
    if (corners.length === 0) continue;
    const known = new Map();
    const list = [];
    const mesh = empty(corners.length, corners.length);
    corners.forEach(([a, b, d], at) => {
      const key = `${a}/${b}/${d}`;
      if (!known.has(key)) {
        const x = list.push(key) - 1;
        known.set(key, x);
        for (let k = 0; k < 3; ++k) {
          mesh.p[3 * x + k] = (v[3 * a + k] - middle[k][0]) * scale;
          mesh.a[A * x + k] = smooth ? smooth[3 * a + k] : d >= 0 ? n[3 * d + k] : 0;
          mesh.a[A * x + 5 + k] = c[3 * a + k];
        }
        for (let k = 0; k < 2; ++k) mesh.a[A * x + 3 + k] = b >= 0 ? t[2 * b + k] : 0;
      }
      mesh.i[at] = known.get(key);
    });
    mesh.p = mesh.p.slice(0, 3 * list.length);
    mesh.a = mesh.a.slice(0, A * list.length);
    meshes.push({ ...mesh, material });
  }
  return { meshes, header, uvs: t.length > 0 };
}

function normals(v, materials) {
  const sums = new Float64Array(v.length);
  for (const corners of materials) {
    for (let f = 0; f < corners.length; f += 3) {
      const [a, b, c] = [0, 1, 2].map((k) => 3 * corners[f + k][0]);
      const e = [0, 1, 2].map((k) => v[b + k] - v[a + k]);
      const g = [0, 1, 2].map((k) => v[c + k] - v[a + k]);
      for (let k = 0; k < 3; ++k) {
        const x = e[(k + 1) % 3] * g[(k + 2) % 3] - e[(k + 2) % 3] * g[(k + 1) % 3];
        for (const corner of [a, b, c]) sums[corner + k] += x;
      }
    }
  }
  for (let x = 0; x < sums.length; x += 3) {
    const length = Math.hypot(sums[x], sums[x + 1], sums[x + 2]) || 1;
    for (let k = 0; k < 3; ++k) sums[x + k] /= length;
  }
  return sums;
}

/// Numbers of equal positions, by their bits.
class Places {
  constructor() { this.known = new Map(); this.count = 0; this.words = new Uint32Array(3); this.floats = new Float32Array(this.words.buffer); }
  of(p, v) {
    for (let k = 0; k < 3; ++k) this.floats[k] = p[3 * v + k] + 0;
    const [x, y, z] = this.words;
    const key = (Math.imul(x, 0x9e3779b1) ^ Math.imul(y, 0x85ebca77) ^ Math.imul(z, 0xc2b2ae3d)) >>> 0;
    const list = this.known.get(key);
    if (!list) { this.known.set(key, [x, y, z, this.count]); return this.count++; }
    for (let k = 0; k < list.length; k += 4) {
      if (list[k] === x && list[k + 1] === y && list[k + 2] === z) return list[k + 3];
    }
    list.push(x, y, z, this.count);
    return this.count++;
  }
}

/// The vertices that triangles use, and these.
function compact(mesh, indices) {
  const numbers = new Map();
  const i = new Uint32Array(indices.length);
  indices.forEach((v, at) => {
    if (!numbers.has(v)) numbers.set(v, numbers.size);
    i[at] = numbers.get(v);
  });
  const out = empty(numbers.size, 0);
  out.i = i;
  for (const [v, at] of numbers) {
    out.p.set(mesh.p.subarray(3 * v, 3 * v + 3), 3 * at);
    out.a.set(mesh.a.subarray(A * v, A * v + A), A * at);
  }
  return out;
}

function join_meshes(meshes) {
  const count = (key) => meshes.reduce((sum, m) => sum + m[key].length, 0);
  const out = empty(count('p') / 3, count('i'));
  let v = 0, at = 0;
  for (const m of meshes) {
    out.p.set(m.p, 3 * v);
    out.a.set(m.a, A * v);
    out.i.set(m.i.map((x) => x + v), at);
    v += m.p.length / 3;
    at += m.i.length;
  }
  return weld(out);
}

/// Vertices that are equal in all become one.
function weld(mesh) {
  const known = new Map();
  const words = new Uint32Array(mesh.a.buffer);
  const places = new Places();
  const first = new Uint32Array(mesh.p.length / 3);
  for (let v = 0; v < first.length; ++v) {
    const key = `${places.of(mesh.p, v)},${words.subarray(A * v, A * v + A).join()}`;
    if (!known.has(key)) known.set(key, v);
    first[v] = known.get(key);
  }
  return compact(mesh, mesh.i.map((v) => first[v]));
}

/// Halves of a mesh along its longest side until each has few enough triangles.
function split(mesh, most) {
  const count = Math.ceil(mesh.i.length / 3 / most);
  const triangles = new Uint32Array(mesh.i.length / 3).map((_, t) => t);
  const middle = (t, k) => mesh.p[3 * mesh.i[3 * t] + k] + mesh.p[3 * mesh.i[3 * t + 1] + k] + mesh.p[3 * mesh.i[3 * t + 2] + k];
  const parts = [];
  const halve = (list, number) => {
    if (number <= 1) {
      const indices = new Uint32Array(3 * list.length);
      list.forEach((t, at) => indices.set(mesh.i.subarray(3 * t, 3 * t + 3), 3 * at));
      parts.push(compact(mesh, indices));
      return;
    }
    let axis = 0, widest = -1;
    for (let k = 0; k < 3; ++k) {
      let low = Infinity, high = -Infinity;
      for (const t of list) { const x = middle(t, k); if (x < low) low = x; if (x > high) high = x; }
      if (high - low > widest) { widest = high - low; axis = k; }
    }
    const sorted = list.slice().sort((a, b) => middle(a, axis) - middle(b, axis) || a - b);
    const left = number >> 1;
    const at = Math.round((sorted.length * left) / number);
    halve(sorted.subarray(0, at), left);
    halve(sorted.subarray(at), number - left);
  };
  halve(triangles, count);
  return parts;
}

/// Places of each cluster's vertices, and of each place the clusters.
function adjacency(clusters) {
  const places = new Places();
  const of = clusters.map((c) => Uint32Array.from({ length: c.p.length / 3 }, (_, v) => places.of(c.p, v)));
  const users = new Map();
  const seen = new Int32Array(places.count).fill(-1);
  of.forEach((list, c) => {
    for (const place of new Set(list)) {
      if (seen[place] < 0) seen[place] = c;
      else if (users.has(place)) users.get(place).push(c);
      else users.set(place, [seen[place], c]);
    }
  });
  return { of, users };
}

/// Groups of clusters that share the longest borders.
function group(clusters, users, size) {
  const shared = clusters.map(() => new Map());
  for (const list of users.values()) {
    for (const a of list) for (const b of list) if (a !== b) shared[a].set(b, (shared[a].get(b) ?? 0) + 1);
  }
  const centers = clusters.map((c) => [0, 1, 2].map((k) => { let s = 0; for (let x = k; x < c.p.length; x += 3) s += c.p[x]; return (3 * s) / c.p.length; }));
  const far = (a, b) => Math.hypot(...[0, 1, 2].map((k) => centers[a][k] - centers[b][k]));
  const free = new Set(clusters.keys());
  const groups = [];
  while (free.size > 0) {
    // The one with the fewest free neighbours first: none is left alone.
    let seed = -1, fewest = Infinity;
    for (const c of free) {
      let near = 0;
      for (const other of shared[c].keys()) near += free.has(other) ? 1 : 0;
      if (near < fewest) { fewest = near; seed = c; }
    }
    const members = [seed];
    free.delete(seed);
    while (members.length < size && free.size > 0) {
      let best = -1, most = -Infinity;
      for (const c of free) {
        let common = 0;
        for (const m of members) common += shared[m].get(c) ?? 0;
        const score = common > 0 ? common : -far(seed, c);
        if (score > most) { most = score; best = c; }
      }
      members.push(best);
      free.delete(best);
    }
    groups.push(members);
  }
  return groups;
}

function simplify(mesh, locks, triangles) {
  const m = { p: mesh.p.slice(), a: mesh.a.slice(), i: mesh.i.slice() };
  const [count, error] = simplifier.simplifyWithUpdate(
    m.i, m.p, 3, m.a, A, WEIGHTS, locks, 3 * Math.min(triangles, m.i.length / 3), 1e9, ['ErrorAbsolute']);
  for (let v = 0; v < m.a.length; v += A) {
    const length = Math.hypot(m.a[v], m.a[v + 1], m.a[v + 2]) || 1;
    for (let k = 0; k < 3; ++k) m.a[v + k] /= length;
  }
  return { mesh: compact(m, m.i.subarray(0, count)), error };
}

/// All nodes: clusters with their error and that of what takes their place.
function hierarchy(mesh) {
  let clusters = split(mesh, CLUSTER).map((m) => ({ ...m, error: 0 }));
  const nodes = [];
  while (clusters.length > 0) {
    const { of, users } = adjacency(clusters);
    const groups = group(clusters, users, clusters.length <= GROUP + 1 ? clusters.length : GROUP);
    const group_of = new Int32Array(clusters.length);
    groups.forEach((members, g) => members.forEach((c) => { group_of[c] = g; }));
    const locked = new Set();
    for (const [place, list] of users) if (list.some((c) => group_of[c] !== group_of[list[0]])) locked.add(place);
    const next = [];
    for (const members of groups) {
      const places = new Places();
      const whole = join_meshes(members.map((c) => clusters[c]));
      const lockedHere = new Set();
      for (const c of members) of[c].forEach((place, v) => { if (locked.has(place)) lockedHere.add(places.of(clusters[c].p, v)); });
      const locks = Uint8Array.from({ length: whole.p.length / 3 }, (_, v) => (lockedHere.has(places.of(whole.p, v)) ? 1 : 0));
      const before = whole.i.length / 3;
      const wanted = Math.round(before * KEEP);
      const { mesh: coarse, error } = wanted >= LAST * KEEP ? simplify(whole, locks, wanted) : { mesh: whole, error: 0 };
      const stuck = coarse.i.length / 3 > 0.85 * before || coarse.i.length === 0;
      const worst = Math.max(error, ...members.map((c) => clusters[c].error));
      for (const c of members) nodes.push({ ...clusters[c], parent: stuck ? Infinity : worst });
      if (!stuck) for (const part of split(coarse, CLUSTER)) next.push({ ...part, error: worst * (1 + 1e-6) });
    }
    clusters = next;
  }
  return nodes;
}

const drawn = (nodes, e) => nodes.filter((n) => n.error <= e * (1 + 2e-6) && n.parent > e);
const size_of = (meshes) => meshes.reduce((sum, m) => sum + m.i.length / 3, 0);

/// The cut whose number of triangles is nearest.
function cut(nodes, triangles) {
  const errors = [0, ...new Set(nodes.map((n) => n.parent).filter(Number.isFinite))].sort((a, b) => a - b);
  let best = drawn(nodes, 0);
  for (const e of errors) {
    const some = drawn(nodes, e);
    if (Math.abs(size_of(some) - triangles) < Math.abs(size_of(best) - triangles)) best = some;
  }
  return best;
}

function write(path, source, parts) {
  const out = [...source.header];
  let base = 1;
  for (const { material, ...m } of parts) {
    if (material) out.push(`usemtl ${material}`);
    for (let v = 0; v < m.p.length / 3; ++v) {
      const [p, a] = [m.p.subarray(3 * v, 3 * v + 3), m.a.subarray(A * v, A * v + A)];
      const colour = [5, 6, 7].map((k) => Math.min(1, Math.max(0, a[k])));
      out.push(`v ${p.join(' ')}${source.colours ? ' ' + colour.join(' ') : ''}`);
      out.push(`vn ${a[0]} ${a[1]} ${a[2]}`);
      if (source.uvs) out.push(`vt ${a[3]} ${a[4]}`);
    }
    for (let t = 0; t < m.i.length; t += 3) {
      out.push('f ' + [0, 1, 2].map((k) => { const x = base + m.i[t + k]; return source.uvs ? `${x}/${x}/${x}` : `${x}//${x}`; }).join(' '));
    }
    base += m.p.length / 3;
  }
  writeFileSync(path, out.join('\n') + '\n');
}

const seconds = () => { const { user, system } = process.cpuUsage(); return (user + system) / 1e6; };
const modar = (program, words) => execFileSync(join(BIN, program), words, { encoding: 'utf8', maxBuffer: 1 << 28 });
function bake(obj, bundle, more) {
  const words = ['bake', '--model', obj, '-o', bundle, '--quiet', '--json', '--jobs', '1', '--no-occlusion', ...more];
  return JSON.parse(modar('modar', words)).cpu_seconds;
}
const zstd = (path) => execFileSync('zstd', ['-19', '-c', path], { maxBuffer: 1 << 30 }).length;
const mb = (bytes) => (bytes / 1e6).toFixed(2);

function compare(path, folder) {
  const source = read(path);
  source.colours = source.meshes.some((m) => m.a.some((x, at) => at % A >= 5 && x !== 1));
  const name = basename(path, '.obj');
  const file = (what) => join(folder, what);
  for (const other of readdirSync(dirname(path))) symlinkSync(resolve(dirname(path), other), file(other));  // textures
  write(file('finest.obj'), source, source.meshes);
  const plain = bake(file('finest.obj'), file('finest.modar'), ['--no-lods']);
  const levels = bake(file('finest.obj'), file('levels.modar'), []);
  const begin = seconds();
  const trees = source.meshes.map((m) => ({ material: m.material, nodes: hierarchy(m) }));
  const took = seconds() - begin;
  const nodes = trees.flatMap(({ material, nodes: all }) => all.map((n) => ({ ...n, material })));
  write(file('nodes.obj'), source, nodes);
  bake(file('nodes.obj'), file('nodes.modar'), ['--no-lods']);
  const bytes = (what) => `${mb(statSync(file(what)).size)} (${mb(zstd(file(what)))})`;
  console.log(`${name}: ${size_of(source.meshes)} triangles, ${nodes.length} nodes of ${size_of(nodes)}; MB (zstd): without levels ${bytes('finest.modar')}, today ${bytes('levels.modar')}, nodes ${bytes('nodes.modar')}; CPU s: levels ${(levels - plain).toFixed(2)}, hierarchy ${took.toFixed(2)} in wasm`);
  const list = JSON.parse(modar('modar', ['inspect', file('levels.modar'), '--json'])).models[0].levels.list;
  for (const { triangles } of list.slice(1)) {
    const some = cut(nodes, triangles);
    write(file('cut.obj'), source, some);
    const target = size_of(some);
    const whole = source.meshes.map((m) => ({ material: m.material, ...simplify(m, null, Math.round((m.i.length / 3) * (triangles / size_of(source.meshes)))).mesh }));
    write(file('whole.obj'), source, whole);
    const cells = [name, triangles, target, some.length];
    for (const what of ['cut', 'whole']) {
      bake(file(`${what}.obj`), file(`${what}.modar`), ['--no-lods']);
      const rows = JSON.parse(modar('modar-lab', ['bench', 'views', file('finest.modar'), file('levels.modar'), file(`${what}.modar`), '--json'])).rows;
      const row = (measure) => rows.find((r) => r.measure.startsWith(measure));
      for (const side of [50, 200]) {
        const d = row(`difference of 255 at ${side}`);
        cells.push(d.ours.toFixed(2), d.reference.toFixed(2));
      }
      cells.push(`${Math.round(row('triangles at 200').ours)}/${Math.round(row('triangles at 200').reference)}`);
    }
    console.log(`| ${cells.join(' | ')} |`);
  }
}

await simplifier.ready;
for (const path of process.argv.slice(2)) {
  const folder = mkdtempSync(join(tmpdir(), 'cluster-levels-'));
  try {
    compare(path, folder);
  } finally {
    if (process.env.KEEP_FILES) console.log(folder); else rmSync(folder, { recursive: true });
  }
}

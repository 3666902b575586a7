// The tracker's worker with the build of the engine with vectors: an import by name, since bundlers
// split no workers.
import load from './engine-simd.js';
import {serve} from './modar-worker.js';

serve(load, 'simd');

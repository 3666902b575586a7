// The worker that makes tracker records, with vectors: an import by name, since bundlers split no
// workers.
import load from './engine-record-simd.js';
import {serve} from './record-worker.js';

serve(load);

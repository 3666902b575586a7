// The worker that makes tracker records, without vectors: an import by name, since bundlers split
// no workers.
import load from './engine-record-plain.js';
import {serve} from './record-worker.js';

serve(load);

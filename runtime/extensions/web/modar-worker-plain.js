// The tracker's worker with the build of the engine without vectors: an import by name, since
// bundlers split no workers.
import load from './engine-plain.js';
import {serve} from './modar-worker.js';

serve(load, 'plain');

// @ts-check
// What a worker does that makes one tracker record of a picture (record.cpp), for modar.js.
import {ModarError, strandedFile} from './engine.js';

/**
 * @param {any} module
 * @param {{ pixels: ArrayBuffer, width: number, height: number }} picture
 */
function make(module, {pixels, width, height}) {
  const rgba = new Uint8Array(pixels);
  const address = module._web_reserve(rgba.length);
  module.HEAPU8.set(rgba, address);
  if (module._web_record(address, width, height) !== 0) {
    const [code, where, cause, cure] =
        [0, 1, 2, 3].map((field) => module.UTF8ToString(module._web_error(field)));
    throw new ModarError({code, where, cause, cure});
  }
  const at = module._web_record_bytes();
  return module.HEAPU8.slice(at, at + module._web_record_size());
}

/**
 * Starts this worker with one of the builds of the module.
 * @param {(options: object) => Promise<any>} load
 */
export function serve(load) {
  const loading = load(strandedFile('') ? {locateFile: strandedFile} : {});
  loading.catch(() => {});  // answered to the message
  self.onmessage = async ({data}) => {
    try {
      const record = make(await loading, data);
      self.postMessage({type: 'record', call: data.call, record}, {transfer: [record.buffer]});
    } catch (error) {
      const told = error instanceof ModarError ?
          error.plain() :
          {code: 'web.worker', cause: String(error instanceof Error ? error.message : error)};
      self.postMessage({type: 'failed', call: data.call, error: told});
    }
  };
}

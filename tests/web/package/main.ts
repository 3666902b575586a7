// A visitor of the package's: what a strict TypeScript project writes. tests/web/package_test.py builds and opens it.
import { drawFrame, load, type Modar, projectionOf, type Pose } from 'modar';
import { View } from 'modar/view';
import { ModarViewer } from 'modar/viewer';

declare global {
  interface Window { result?: string }
}

async function pictureOf(address: string): Promise<ImageData> {
  const image = new Image();
  image.src = address;
  await image.decode();
  const context = document.createElement('canvas').getContext('2d')!;
  Object.assign(context.canvas, { width: image.naturalWidth, height: image.naturalHeight });
  context.drawImage(image, 0, 0);
  return context.getImageData(0, 0, image.naturalWidth, image.naturalHeight);
}

/** The element as a page has it: its state, a word and a name that it shows, and the number of a picture that is added. */
async function lookAround(): Promise<(string | number)[]> {
  const viewer = document.createElement('modar-viewer');
  viewer.src = 'demo.modar';
  viewer.addEventListener('found', ({ detail }) => console.assert(detail.inliers > 0));
  viewer.addEventListener('error', ({ error }) => console.error(error));
  document.body.append(viewer);
  await viewer.look();
  const part = (id: string): string => viewer.shadowRoot?.getElementById(id)?.textContent ?? '';
  console.assert(viewer instanceof ModarViewer && viewer.layers[1].width > 0);
  const image = new Image();
  image.src = 'frame.png';
  await image.decode();
  const own: number = await viewer.addPattern(image, { name: 'mine', scene: 0 });
  return [viewer.state, part('start'), part('label-name'), own];
}

async function main(): Promise<string> {
  const modar: Modar = await load('demo.modar');
  const onUpdated = ({ detail }: CustomEvent<Pose>): void => console.assert(detail.view.length === 16);
  modar.addEventListener('updated', onUpdated, { passive: true });
  modar.removeEventListener('updated', onUpdated);
  modar.addEventListener('error', ({ detail }) => console.error(detail.code));
  const { data, width, height } = await pictureOf('frame.png');
  const gray = data.filter((_, i) => i % 4 === 1);
  const camera = { width, height, focal: width, focalSigma: 0 };
  let { poses } = await modar.step(new Uint8Array(gray), width, height, 0);
  for (let i = 1; i < 10 && poses[0] === 0; ++i) ({ poses } = await modar.step(new Uint8Array(gray), width, height, i / 30));
  const [picture, models] = ['picture', 'models'].map((id) => document.getElementById(id) as HTMLCanvasElement);
  const view = await View.create(modar, { picture: picture!, models: models! });
  const size = drawFrame(picture!, { source: models!, camera });
  const projection = projectionOf(camera, 0.1, 10, size);
  return [modar.patterns[0]?.name, poses[0], view.webgl, projection.length, ...await lookAround()].join();
}

main().then((text) => { window.result = text; }, (error: unknown) => { window.result = String(error); });

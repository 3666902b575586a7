import {Canvas, useThree} from '@react-three/fiber';
import {Print, Prints} from 'modar/fiber';
import {createElement as h} from 'react';
import {createRoot} from 'react-dom/client';

/** For the console. */
function Exposed() {
  Object.assign(globalThis, {camera: useThree(({camera}) => camera)});
}

// In JSX: <Canvas><Prints bundle="demo.modar"><Print name="cover"><mesh>...</mesh></Print></Prints></Canvas>
// The picture's longer side reaches from -1 to 1 of its print.
const cube = h('mesh', {position: [0, 0, 0.25]}, h('boxGeometry', {args: [0.5, 0.5, 0.5]}),
               h('meshBasicMaterial', {color: '#0f0'}));
const prints = h(Prints, {bundle: 'demo.modar', onError: console.error},
                 h(Print, {name: 'cover', onUpdate: (cover) => Object.assign(globalThis, {cover})}, cube));
createRoot(document.getElementById('root')).render(h(Canvas, {flat: true}, h(Exposed), prints));

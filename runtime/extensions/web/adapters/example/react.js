import {ModarViewer} from 'modar/react';
import {createElement as h} from 'react';
import {createRoot} from 'react-dom/client';

const seen = [];
// In JSX: <ModarViewer src="demo.modar" alt="A red vase" onFound={...} />
createRoot(document.getElementById('root')).render(h(ModarViewer, {
  src: 'demo.modar',
  alt: 'A red vase',
  ref: (viewer) => Object.assign(globalThis, {viewer, seen}),  // for the console
  onStateChange: () => seen.push(globalThis.viewer.state),
  onFound: ({detail}) => seen.push(detail.name),
}));

// A camera without a device, before any module runs: a picture in a canvas, or nothing where `camera.shows` is null.
const camera = { shows: null, opened: [], refuses: '' };
{
  const canvas = Object.assign(document.createElement('canvas'), { width: 640, height: 480 });
  const context = canvas.getContext('2d');
  setInterval(() => {
    context.fillStyle = '#777';
    context.fillRect(0, 0, 640, 480);
    if (camera.shows) context.drawImage(camera.shows, 0, 0, 640, 480);
  }, 60);
  const devices = {
    getUserMedia: async () => {
      if (camera.refuses) throw new DOMException('refused', camera.refuses);
      const stream = canvas.captureStream(15);
      camera.opened.push(stream.getVideoTracks()[0]);
      return stream;
    },
    enumerateDevices: async () => [],
  };
  Object.defineProperty(navigator, 'mediaDevices', { value: devices });
}

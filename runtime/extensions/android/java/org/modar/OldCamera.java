package org.modar;

import android.graphics.ImageFormat;
import android.graphics.SurfaceTexture;
import android.hardware.Camera;
import java.util.List;

/** android.hardware.Camera: the only camera below API 21, and the better one on many phones above. */
@SuppressWarnings("deprecation")
final class OldCamera extends CameraFeed implements Camera.PreviewCallback {
    /** A texture that nobody draws: previews want one. */
    private static final int NO_TEXTURE = 10;

    private Camera camera;
    private SurfaceTexture texture;
    private final Nv21[] frames = new Nv21[BUFFERS];
    private boolean halted;

    OldCamera(Stage stage, int poseCount) {
        super(stage, poseCount);
    }

    /** NV21 in a callback buffer. */
    private final class Nv21 extends Frame {
        final byte[] pixels;

        Nv21(int bytes) {
            super(poseCount);
            pixels = new byte[bytes];
        }

        @Override
        int track(long session) throws ModarException {
            return Native.onCameraFrame(session, pixels, timeS, poses.bytes);
        }

        @Override
        void draw(long session) throws ModarException {
            Native.onDrawFrame(session, pixels, poses.bytes, drawn);
        }

        @Override
        void release() {
            free(pixels);
        }
    }

    @Override
    void open() throws Exception {
        int id = backCamera();
        camera = Camera.open(id);
        Camera.Size size = configure();
        Camera.CameraInfo info = new Camera.CameraInfo();
        Camera.getCameraInfo(id, info);
        texture = new SurfaceTexture(NO_TEXTURE);
        camera.setPreviewTexture(texture);
        stage.cameraOpened(size.width, size.height, info.orientation);
        for (int i = 0; i < BUFFERS; i++) {
            frames[i] = new Nv21(size.width * size.height * 3 / 2);
            camera.addCallbackBuffer(frames[i].pixels);
        }
        camera.setPreviewCallbackWithBuffer(this);
        camera.startPreview();
    }

    private static int backCamera() {
        Camera.CameraInfo info = new Camera.CameraInfo();
        for (int id = 0; id < Camera.getNumberOfCameras(); id++) {
            Camera.getCameraInfo(id, info);
            if (info.facing == Camera.CameraInfo.CAMERA_FACING_BACK) return id;
        }
        return 0;
    }

    private Camera.Size configure() {
        Camera.Parameters parameters = camera.getParameters();
        Camera.Size best = null;
        for (Camera.Size size : parameters.getSupportedPreviewSizes()) {
            if (best == null || distance(size.width, size.height) < distance(best.width, best.height)) best = size;
        }
        parameters.setPreviewSize(best.width, best.height);
        parameters.setPreviewFormat(ImageFormat.NV21);
        List<String> focus = parameters.getSupportedFocusModes();
        if (focus != null && focus.contains(Camera.Parameters.FOCUS_MODE_CONTINUOUS_VIDEO)) {
            parameters.setFocusMode(Camera.Parameters.FOCUS_MODE_CONTINUOUS_VIDEO);
        }
        camera.setParameters(parameters);
        return best;
    }

    @Override
    public void onPreviewFrame(byte[] data, Camera from) {
        for (Nv21 frame : frames) {
            if (frame.pixels != data) continue;
            frame.timeS = System.nanoTime() * 1e-9;
            stage.frame(frame);
        }
    }

    private synchronized void free(byte[] buffer) {
        if (!halted) camera.addCallbackBuffer(buffer);
    }

    @Override
    void halt() {
        synchronized (this) {
            halted = true;
        }
        if (camera == null) return;
        camera.setPreviewCallbackWithBuffer(null);
        camera.stopPreview();
        camera.release();
        if (texture != null) texture.release();
    }

    @Override
    void close() {}
}

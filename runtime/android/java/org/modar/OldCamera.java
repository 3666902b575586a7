package org.modar;

import android.graphics.ImageFormat;
import android.graphics.SurfaceTexture;
import android.hardware.Camera;
import java.io.IOException;
import java.util.List;

/** android.hardware.Camera: the only camera below API 21, and the better one on many phones above. */
@SuppressWarnings("deprecation")
final class OldCamera extends CameraFeed implements Camera.PreviewCallback, Frame.Nv21.Owner {
    /** A texture that nobody draws: previews want one. */
    private static final int NO_TEXTURE = 10;

    private Camera camera;
    private SurfaceTexture texture;
    private final Frame.Nv21[] frames = new Frame.Nv21[BUFFERS];
    private boolean halted;

    OldCamera(Sink sink, int patterns) {
        super(sink, patterns);
    }

    @Override
    void open() {
        try {
            int id = backCamera();
            camera = Camera.open(id);
            Camera.Size size = configure();
            Camera.CameraInfo info = new Camera.CameraInfo();
            Camera.getCameraInfo(id, info);
            texture = new SurfaceTexture(NO_TEXTURE);
            camera.setPreviewTexture(texture);
            sink.cameraOpened(size.width, size.height, info.orientation);
            for (int i = 0; i < BUFFERS; i++) {
                frames[i] = new Frame.Nv21(patterns, new byte[size.width * size.height * 3 / 2], this);
                camera.addCallbackBuffer(frames[i].pixels);
            }
            camera.setPreviewCallbackWithBuffer(this);
            camera.startPreview();
        } catch (IOException failed) {
            sink.cameraFailed(failed.getMessage());
        } catch (RuntimeException failed) {
            sink.cameraFailed(failed.getMessage()); // another app has it, or there is none
        }
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
        if (best == null) throw new IllegalStateException("the camera names no size of frames");
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
        for (Frame.Nv21 frame : frames) {
            if (frame.pixels != data) continue;
            frame.timeS = System.nanoTime() * 1e-9;
            sink.frame(frame);
        }
    }

    @Override
    public synchronized void free(byte[] buffer) {
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

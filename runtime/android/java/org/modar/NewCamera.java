package org.modar;

import android.annotation.TargetApi;
import android.content.Context;
import android.graphics.ImageFormat;
import android.hardware.camera2.CameraAccessException;
import android.hardware.camera2.CameraCaptureSession;
import android.hardware.camera2.CameraCharacteristics;
import android.hardware.camera2.CameraDevice;
import android.hardware.camera2.CameraManager;
import android.hardware.camera2.CaptureRequest;
import android.hardware.camera2.params.StreamConfigurationMap;
import android.media.Image;
import android.media.ImageReader;
import android.util.Size;
import android.view.Surface;
import java.util.Collections;
import java.util.concurrent.ArrayBlockingQueue;

/** Camera2, from API 21 on: frames stay in the camera's own memory. */
@TargetApi(21)
final class NewCamera extends CameraFeed implements ImageReader.OnImageAvailableListener, Frame.Planes.Owner {
    private final CameraManager manager;
    private final ArrayBlockingQueue<Frame.Planes> idle = new ArrayBlockingQueue<>(BUFFERS);
    private CameraDevice device;
    private ImageReader reader;
    private boolean halted;

    NewCamera(Context context, Sink sink, int patterns) {
        super(sink, patterns);
        manager = (CameraManager) context.getSystemService(Context.CAMERA_SERVICE);
        for (int i = 0; i < BUFFERS - 1; i++) idle.add(new Frame.Planes(patterns, this));
    }

    /** False where Camera2 is but emulated, or refuses to answer. */
    static boolean isNative(Context context) {
        try {
            CameraManager manager = (CameraManager) context.getSystemService(Context.CAMERA_SERVICE);
            Integer level = manager.getCameraCharacteristics(backCamera(manager))
                    .get(CameraCharacteristics.INFO_SUPPORTED_HARDWARE_LEVEL);
            return level != null && level != CameraCharacteristics.INFO_SUPPORTED_HARDWARE_LEVEL_LEGACY;
        } catch (CameraAccessException refused) {
            return false;
        } catch (RuntimeException refused) {
            return false;
        }
    }

    private static String backCamera(CameraManager manager) throws CameraAccessException {
        String[] ids = manager.getCameraIdList();
        for (String id : ids) {
            Integer facing = manager.getCameraCharacteristics(id).get(CameraCharacteristics.LENS_FACING);
            if (facing != null && facing == CameraCharacteristics.LENS_FACING_BACK) return id;
        }
        if (ids.length == 0) throw new IllegalStateException("the phone has no camera");
        return ids[0];
    }

    @Override
    void open() {
        try {
            String id = backCamera(manager);
            CameraCharacteristics traits = manager.getCameraCharacteristics(id);
            Size size = sizeOf(traits.get(CameraCharacteristics.SCALER_STREAM_CONFIGURATION_MAP));
            Integer turn = traits.get(CameraCharacteristics.SENSOR_ORIENTATION);
            reader = ImageReader.newInstance(size.getWidth(), size.getHeight(), ImageFormat.YUV_420_888, BUFFERS);
            reader.setOnImageAvailableListener(this, handler);
            sink.cameraOpened(size.getWidth(), size.getHeight(), turn == null ? 90 : turn);
            manager.openCamera(id, new Opened(), handler);
        } catch (CameraAccessException failed) {
            sink.cameraFailed(failed.getMessage());
        } catch (RuntimeException failed) {
            sink.cameraFailed(failed.getMessage());
        }
    }

    private static Size sizeOf(StreamConfigurationMap map) {
        Size best = null;
        for (Size size : map.getOutputSizes(ImageFormat.YUV_420_888)) {
            if (best == null || distance(size.getWidth(), size.getHeight())
                    < distance(best.getWidth(), best.getHeight())) {
                best = size;
            }
        }
        if (best == null) throw new IllegalStateException("the camera names no size of frames");
        return best;
    }

    private final class Opened extends CameraDevice.StateCallback {
        @Override
        public void onOpened(CameraDevice opened) {
            if (halted) {
                opened.close();
                return;
            }
            device = opened;
            try {
                opened.createCaptureSession(
                        Collections.singletonList(reader.getSurface()), new Configured(), handler);
            } catch (CameraAccessException failed) {
                sink.cameraFailed(failed.getMessage());
            } catch (IllegalStateException failed) {
                sink.cameraFailed(failed.getMessage()); // a call came, and the camera was closed meanwhile
            }
        }

        @Override
        public void onDisconnected(CameraDevice lost) {
            lost.close();
            sink.cameraFailed("another app took the camera");
        }

        @Override
        public void onError(CameraDevice broken, int error) {
            broken.close();
            sink.cameraFailed("the camera answers with error " + error);
        }
    }

    private final class Configured extends CameraCaptureSession.StateCallback {
        @Override
        public void onConfigured(CameraCaptureSession session) {
            if (halted) return;
            try {
                CaptureRequest.Builder request = device.createCaptureRequest(CameraDevice.TEMPLATE_PREVIEW);
                request.set(CaptureRequest.CONTROL_AF_MODE, CaptureRequest.CONTROL_AF_MODE_CONTINUOUS_VIDEO);
                request.addTarget(reader.getSurface());
                CameraCaptureSession.CaptureCallback nobody = null;
                session.setRepeatingRequest(request.build(), nobody, handler);
            } catch (CameraAccessException failed) {
                sink.cameraFailed(failed.getMessage());
            } catch (IllegalStateException failed) {
                sink.cameraFailed(failed.getMessage());
            }
        }

        @Override
        public void onConfigureFailed(CameraCaptureSession session) {
            sink.cameraFailed("the camera refuses this size of frames");
        }
    }

    @Override
    public void onImageAvailable(ImageReader from) {
        if (halted) return;
        Frame.Planes frame = idle.poll();
        if (frame == null) return; // all are in use: the next frame finds one
        Image image = from.acquireLatestImage();
        if (image == null) {
            idle.add(frame);
            return;
        }
        frame.take(image);
        sink.frame(frame);
    }

    @Override
    public void free(Frame.Planes frame) {
        idle.add(frame);
    }

    @Override
    void halt() {
        halted = true;
        if (device != null) device.close();
    }

    @Override
    void close() {
        if (reader != null) reader.close();
    }
}

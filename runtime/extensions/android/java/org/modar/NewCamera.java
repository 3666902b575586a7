package org.modar;

import android.annotation.TargetApi;
import android.content.Context;
import android.graphics.ImageFormat;
import android.hardware.SensorManager;
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

/** Camera2, from API 21 on: frames stay in the camera's own memory. */
@TargetApi(21)
final class NewCamera extends CameraFeed implements ImageReader.OnImageAvailableListener {
    private final Context context;
    private final CameraManager manager;
    /** As many as may be held of an ImageReader's images, less the one that it fills. */
    private final Planes[] frames = new Planes[BUFFERS - 1];
    private CameraDevice device;
    private ImageReader reader;
    private boolean halted;
    /** Null: the phone has none, or another clock than the camera. */
    private Gyroscope gyroscope;
    private int sensorDegrees;
    private boolean front;
    private double trackedS;

    NewCamera(Context context, Stage stage, int poseCount) {
        super(stage, poseCount);
        this.context = context;
        manager = (CameraManager) context.getSystemService(Context.CAMERA_SERVICE);
        for (int i = 0; i < frames.length; i++) frames[i] = new Planes();
    }

    /** False where Camera2 is but emulated, or refuses to answer. */
    static boolean isNative(Context context) {
        try {
            CameraManager manager = (CameraManager) context.getSystemService(Context.CAMERA_SERVICE);
            Integer level = manager.getCameraCharacteristics(backCamera(manager))
                                    .get(CameraCharacteristics.INFO_SUPPORTED_HARDWARE_LEVEL);
            return level != null && level != CameraCharacteristics.INFO_SUPPORTED_HARDWARE_LEVEL_LEGACY;
        } catch (Exception refused) { // the old camera may be luckier
            return false;
        }
    }

    /** The planes of an Image. */
    private final class Planes extends Frame {
        private Image.Plane[] planes;
        /** Null: free to take the next. */
        volatile Image image;

        Planes() {
            super(poseCount);
        }

        void take(Image next) {
            planes = next.getPlanes();
            timeS = next.getTimestamp() * 1e-9;
            image = next;
        }

        @Override
        int track(long session) throws ModarException {
            Image.Plane luma = planes[0];
            if (gyroscope != null && gyroscope.turn(trackedS, timeS)) {
                double[] turned = gyroscope.turned;
                Native.onTurn(session, turned[0], turned[1], turned[2], sensorDegrees, front);
            }
            trackedS = timeS;
            return Native.onCameraPlane(session, luma.getBuffer(), luma.getRowStride(), timeS, poses.bytes);
        }

        @Override
        void draw(long session) throws ModarException {
            Image.Plane u = planes[1];
            Native.onDrawPlanes(session, planes[0].getBuffer(), planes[0].getRowStride(), u.getBuffer(),
                    planes[2].getBuffer(), u.getRowStride(), u.getPixelStride(), poses.bytes, drawn);
        }

        @Override
        void release() {
            image.close();
            image = null;
        }
    }

    private static String backCamera(CameraManager manager) throws CameraAccessException {
        String[] ids = manager.getCameraIdList();
        for (String id : ids) {
            Integer facing = manager.getCameraCharacteristics(id).get(CameraCharacteristics.LENS_FACING);
            if (facing != null && facing == CameraCharacteristics.LENS_FACING_BACK) return id;
        }
        return ids[0];
    }

    @Override
    void open() throws Exception {
        String id = backCamera(manager);
        CameraCharacteristics traits = manager.getCameraCharacteristics(id);
        Size size = sizeOf(traits.get(CameraCharacteristics.SCALER_STREAM_CONFIGURATION_MAP));
        Integer turn = traits.get(CameraCharacteristics.SENSOR_ORIENTATION);
        reader = ImageReader.newInstance(size.getWidth(), size.getHeight(), ImageFormat.YUV_420_888, BUFFERS);
        reader.setOnImageAvailableListener(this, handler);
        sensorDegrees = turn == null ? 90 : turn;
        openGyroscope(traits);
        stage.cameraOpened(size.getWidth(), size.getHeight(), sensorDegrees);
        manager.openCamera(id, new Opened(), handler);
    }

    /** Turns help only where frames are dated by the sensors' clock, and a camera on a cable turns by itself. */
    private void openGyroscope(CameraCharacteristics traits) {
        Integer clock = traits.get(CameraCharacteristics.SENSOR_INFO_TIMESTAMP_SOURCE);
        Integer facing = traits.get(CameraCharacteristics.LENS_FACING);
        if (clock == null || clock != CameraCharacteristics.SENSOR_INFO_TIMESTAMP_SOURCE_REALTIME) return;
        if (facing == null || facing > CameraCharacteristics.LENS_FACING_BACK) return;
        front = facing == CameraCharacteristics.LENS_FACING_FRONT;
        gyroscope = Gyroscope.open((SensorManager) context.getSystemService(Context.SENSOR_SERVICE), handler);
    }

    private static Size sizeOf(StreamConfigurationMap map) {
        Size best = null;
        for (Size size : map.getOutputSizes(ImageFormat.YUV_420_888)) {
            if (best == null
                    || distance(size.getWidth(), size.getHeight()) < distance(best.getWidth(), best.getHeight())) {
                best = size;
            }
        }
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
                opened.createCaptureSession(Collections.singletonList(reader.getSurface()), new Configured(), handler);
            } catch (Exception failed) { // a call came, and the camera was closed meanwhile
                stage.cameraFailed(failed.getMessage());
            }
        }

        @Override
        public void onDisconnected(CameraDevice lost) {
            lost.close();
            stage.cameraFailed("another app took the camera");
        }

        @Override
        public void onError(CameraDevice broken, int error) {
            broken.close();
            stage.cameraFailed("the camera answers with error " + error);
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
            } catch (Exception failed) {
                stage.cameraFailed(failed.getMessage());
            }
        }

        @Override
        public void onConfigureFailed(CameraCaptureSession session) {
            stage.cameraFailed("the camera refuses this size of frames");
        }
    }

    @Override
    public void onImageAvailable(ImageReader from) {
        for (Planes frame : frames) {
            if (halted || frame.image != null) continue;
            Image image = from.acquireLatestImage();
            if (image == null) return;
            frame.take(image);
            stage.frame(frame);
            return;
        }
        // All are in use: the next frame finds one.
    }

    @Override
    void halt() {
        halted = true;
        if (gyroscope != null) gyroscope.close();
        if (device != null) device.close();
    }

    @Override
    void close() {
        if (reader != null) reader.close();
    }
}

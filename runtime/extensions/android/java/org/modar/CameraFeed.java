package org.modar;

import android.content.Context;
import android.os.Build;
import android.os.Handler;
import android.os.HandlerThread;
import android.os.Message;

/** The back camera, as frames for the stage on a thread of its own. */
abstract class CameraFeed implements Handler.Callback {
    /** Frames of some 640 x 480: features are found there as well as in larger ones, for a fraction of the time. */
    static final int PIXELS = 640 * 480;
    /** One that fills, one that is tracked, one that waits, one that is drawn. */
    static final int BUFFERS = 4;
    private static final int OPEN = 0;
    private static final int HALT = 1;

    final Stage stage;
    final int poseCount;
    Handler handler;
    private HandlerThread thread;

    CameraFeed(Stage stage, int poseCount) {
        this.stage = stage;
        this.poseCount = poseCount;
    }

    /** Camera2 where the phone has it in full; its emulation over the old interface is slower than that itself. */
    static CameraFeed create(Context context, Stage stage, int poseCount) {
        if (Build.VERSION.SDK_INT >= 21 && NewCamera.isNative(context)) return new NewCamera(context, stage, poseCount);
        return new OldCamera(stage, poseCount);
    }

    final void start() {
        thread = new HandlerThread("modar-camera");
        thread.start();
        handler = new Handler(thread.getLooper(), this);
        handler.sendEmptyMessage(OPEN);
    }

    /** Returns when no more frames come. Those that were handed over stay whole until close(). */
    final void stop() {
        handler.sendEmptyMessage(HALT);
        thread.quitSafely();
        try {
            thread.join();
        } catch (InterruptedException interrupted) {
            Thread.currentThread().interrupt();
        }
    }

    @Override
    public final boolean handleMessage(Message message) {
        try {
            if (message.what == OPEN) {
                open();
            } else {
                halt();
            }
        } catch (Exception failed) { // cameras throw what they like: another app has it, or no camera exists
            stage.cameraFailed(failed.getMessage());
        }
        return true;
    }

    /** On the camera's thread. */
    abstract void open() throws Exception;

    /** On the camera's thread: frees the camera for other apps. */
    abstract void halt();

    /** After stop(), when every frame was released. */
    abstract void close();

    /** How far a size is from the wanted one; sides are even where chroma is shared. */
    static long distance(int width, int height) {
        if (width % 2 != 0 || height % 2 != 0) return Long.MAX_VALUE;
        return Math.abs((long) width * height - PIXELS);
    }
}

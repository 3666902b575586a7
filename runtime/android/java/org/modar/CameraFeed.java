package org.modar;

import android.content.Context;
import android.os.Build;
import android.os.Handler;
import android.os.HandlerThread;

/** The back camera, as frames on a thread of its own. */
abstract class CameraFeed {
    /** Frames of some 640 x 480: features are found there as well as in larger ones, for a fraction of the time. */
    static final int PIXELS = 640 * 480;
    /** One that fills, one that is tracked, one that waits, one that is drawn. */
    static final int BUFFERS = 4;

    interface Sink {
        /** Before the first frame. turn: degrees that a frame is turned clockwise to be upright on the sensor's phone. */
        void cameraOpened(int width, int height, int turn);

        /** Hands over a frame; the sink releases it. */
        void frame(Frame frame);

        void cameraFailed(String cause);
    }

    final Sink sink;
    final int patterns;
    Handler handler;
    private HandlerThread thread;

    CameraFeed(Sink sink, int patterns) {
        this.sink = sink;
        this.patterns = patterns;
    }

    /** Camera2 where the phone has it in full; its emulation over the old interface is slower than that itself. */
    static CameraFeed create(Context context, Sink sink, int patterns) {
        if (Build.VERSION.SDK_INT >= 21 && NewCamera.isNative(context)) return new NewCamera(context, sink, patterns);
        return new OldCamera(sink, patterns);
    }

    final void start() {
        thread = new HandlerThread("modar-camera");
        thread.start();
        handler = new Handler(thread.getLooper());
        handler.post(new Runnable() {
            @Override
            public void run() {
                open();
            }
        });
    }

    /** Returns when no more frames come. Those that were handed over stay whole until close(). */
    final void stop() {
        handler.post(new Runnable() {
            @Override
            public void run() {
                halt();
            }
        });
        thread.quitSafely();
        try {
            thread.join();
        } catch (InterruptedException interrupted) {
            Thread.currentThread().interrupt();
        }
    }

    /** On the camera's thread. */
    abstract void open();

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

package org.modar;

import java.util.concurrent.Semaphore;
import java.util.concurrent.atomic.AtomicReference;

/** Hands the newest frame from the camera's thread to GL's. */
final class FrameHandover {
    private final AtomicReference<Frame> next = new AtomicReference<>();
    /** One permit, to draw a frame or to give frames back. Callers sleep in the order in which they came. */
    private final Semaphore permit = new Semaphore(1, true);
    private Frame shown;

    /** On the camera's thread, which waits for nobody. Takes the frame over, to release it. */
    void put(Frame frame) {
        Frame late = next.getAndSet(frame);
        if (late != null) late.release();
    }

    /** The newest frame, or null if none came; it stays until done(). */
    Frame take() {
        permit.acquireUninterruptibly();
        Frame newest = next.getAndSet(null);
        if (newest == null) return shown;
        if (shown != null) shown.release();
        return shown = newest;
    }

    /** After take(). */
    void done() {
        permit.release();
    }

    /** Gives all frames back. */
    void drop() {
        permit.acquireUninterruptibly();
        try {
            Frame waiting = next.getAndSet(null);
            if (waiting != null) waiting.release();
            if (shown != null) shown.release();
            shown = null;
        } finally {
            permit.release();
        }
    }
}

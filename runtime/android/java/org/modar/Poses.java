package org.modar;

import java.nio.ByteBuffer;
import java.nio.ByteOrder;
import java.nio.FloatBuffer;

/** The poses of one frame, in memory that the native half writes and reads. */
public final class Poses {
    /** Floats of a pattern: visible, shown, inliers, fit, rotation 9, translation 3, corners 8, view 16. */
    public static final int FLOATS = 40;
    public static final int BYTES = 4 * FLOATS;
    public static final int ROTATION = 4;
    public static final int TRANSLATION = 13;
    public static final int CORNERS = 16;
    /** Pattern space to GL's eye space, column-major. */
    public static final int VIEW = 24;

    public final ByteBuffer bytes;
    public final int patterns;
    private final FloatBuffer floats;

    public Poses(int patterns) {
        this.patterns = patterns;
        bytes = ByteBuffer.allocateDirect(Math.max(1, patterns) * BYTES).order(ByteOrder.nativeOrder());
        floats = bytes.asFloatBuffer();
    }

    public float get(int pattern, int index) {
        return floats.get(pattern * FLOATS + index);
    }

    /** As if nothing was seen. */
    void clear() {
        for (int i = 0; i < patterns; i++) floats.put(i * FLOATS + 1, 0);
    }

    /** As if a pattern was seen, without a camera. */
    void show(int pattern) {
        for (int i = 0; i < patterns; i++) floats.put(i * FLOATS + 1, i == pattern ? 1 : 0);
    }

    /** Measured in this frame. */
    public boolean visible(int pattern) {
        return get(pattern, 0) != 0;
    }

    /** The model is to be drawn: also in the frame or two after it was visible. */
    public boolean shown(int pattern) {
        return get(pattern, 1) != 0;
    }
}

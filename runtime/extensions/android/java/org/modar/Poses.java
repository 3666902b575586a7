package org.modar;

import java.nio.ByteBuffer;
import java.nio.ByteOrder;
import java.nio.FloatBuffer;

/** The poses of one frame, in memory that the native half writes and reads. */
public final class Poses {
    /** Floats of a pattern or copy, as modar/pose_floats.hpp has them; where its parts begin follows. */
    public static final int FLOATS = 45;
    public static final int BYTES = 4 * FLOATS;
    public static final int VISIBLE = 0;
    public static final int SHOWN = 1;
    public static final int INLIERS = 2;
    /** Share of the examined features that agree with the pose, 0 to 1. */
    public static final int FIT = 3;
    public static final int ROTATION = 4;
    public static final int TRANSLATION = 13;
    public static final int CORNERS = 16;
    /** Pattern space to GL's eye space, column-major. */
    public static final int VIEW = 24;
    public static final int EXTENDED = 40;
    public static final int AGREEING = 41;
    public static final int LIKENESS = 42;
    public static final int POSITION_SIGMA = 43;
    public static final int ROTATION_SIGMA = 44;

    public final ByteBuffer bytes;
    public final int count;
    private final FloatBuffer floats;

    public Poses(int count) {
        this.count = count;
        bytes = ByteBuffer.allocateDirect(Math.max(1, count) * BYTES).order(ByteOrder.nativeOrder());
        floats = bytes.asFloatBuffer();
    }

    public float get(int pattern, int index) {
        return floats.get(pattern * FLOATS + index);
    }

    /** As if nothing was seen. */
    void clear() {
        for (int i = 0; i < count; i++) floats.put(i * FLOATS + SHOWN, 0);
    }

    /** As if a pattern was seen, without a camera. */
    void show(int pattern) {
        for (int i = 0; i < count; i++) floats.put(i * FLOATS + SHOWN, i == pattern ? 1 : 0);
    }

    /** Measured in this frame. */
    public boolean visible(int pattern) {
        return get(pattern, VISIBLE) != 0;
    }

    /** The model is to be drawn: also in the frame or two after it was visible. */
    public boolean shown(int pattern) {
        return get(pattern, SHOWN) != 0;
    }
}

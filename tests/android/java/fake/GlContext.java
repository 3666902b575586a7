package fake;

import java.nio.ByteBuffer;

/** What a phone's window gives GL: a context with colour and depth, through Mesa. One a thread. */
public final class GlContext {
    static {
        System.loadLibrary("fake_gl");
    }

    private GlContext() {}

    public static native void create(int width, int height);

    /** As a phone does when it sleeps: everything in the context is gone. */
    public static native void destroy();

    /** RGBA from the bottom up, of the whole surface. */
    public static native void read(ByteBuffer rgba);

    public static native void clear(float gray);

    public static native String string(int name);
}

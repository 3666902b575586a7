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

    /** A further window of that size, which use() makes the current one; 0 is the screen's. */
    public static native int window(int width, int height);

    public static native void use(int window);

    /** RGBA from the bottom up, of the current window. */
    public static native void pixels(int width, int height, ByteBuffer rgba);

    public static native void clear(float gray);

    public static native String string(int name);
}

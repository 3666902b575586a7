package org.modar;

import android.os.Build;
import java.util.Arrays;

/** What whoever looks after forty phones wants to know of one. */
final class Diagnostics {
    /** Frames that the times are taken over: ten seconds at 30 a second. */
    private static final int WINDOW = 300;

    String bundle = "none";
    String release = "none";
    volatile String camera = "not opened";
    volatile String gl = "no context yet";
    volatile String profile = "";
    volatile long gpuBytes;
    volatile long frameBytes;
    private final float[] trackMs = new float[WINDOW];
    private final float[] drawMs = new float[WINDOW];
    private volatile long tracked;
    private volatile long drawn;
    private volatile long again;
    private volatile long seen;
    private volatile long firstNs;
    private volatile long lastNs;
    private final StringBuffer errors = new StringBuffer();

    /** By the camera's thread alone. */
    void tracked(long nanoseconds, boolean visible) {
        trackMs[(int) (tracked++ % WINDOW)] = nanoseconds * 1e-6f;
        if (visible) seen++;
        lastNs = System.nanoTime();
        if (firstNs == 0) firstNs = lastNs;
    }

    /** By GL's thread alone. */
    void drawn(long nanoseconds) {
        drawMs[(int) (drawn++ % WINDOW)] = nanoseconds * 1e-6f;
    }

    /** By GL's thread alone. */
    void drawnAgain() {
        again++;
    }

    /** By any thread. */
    void error(String text) {
        if (errors.length() > 4000) errors.delete(0, 2000);
        errors.append(text).append('\n');
    }

    long frames() {
        return tracked;
    }

    /** The profile of assets/devices/ whose limits this GPU has; null where the context's own count. */
    static String profileOf(String renderer) {
        if (renderer == null) return null;
        if (renderer.contains("Mali-400") || renderer.contains("Mali-450")) return "mali400";
        if (renderer.contains("Adreno (TM) 20") || renderer.contains("Adreno 20")) return "adreno200";
        return null;
    }

    /** Lines of "name: value", for the screen and the file alike. */
    String text(Words words) {
        int version = Native.version();
        double seconds = (lastNs - firstNs) * 1e-9;
        return words.get("diagnostics", Build.MANUFACTURER, Build.MODEL, Build.VERSION.RELEASE, Build.VERSION.SDK_INT,
                version / 10000, version / 100 % 100, version % 100, gl, profile, bundle, release, camera, tracked,
                seen, drawn, again, again * frameBytes / 1000, tracked > 1 ? (tracked - 1) / seconds : 0,
                share(trackMs, tracked, 50), share(trackMs, tracked, 95), share(drawMs, drawn, 50),
                share(drawMs, drawn, 95), gpuBytes / 1000, errors);
    }

    /** The percentile of the values. */
    private static float share(float[] ms, long count, int percent) {
        int length = (int) Math.min(count, ms.length);
        float[] sorted = Arrays.copyOf(ms, length);
        Arrays.sort(sorted);
        return length == 0 ? 0 : sorted[length * percent / 100];
    }
}

package org.modar;

import android.os.Build;
import java.util.Arrays;
import java.util.Locale;

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
    private final float[] trackMs = new float[WINDOW];
    private final float[] drawMs = new float[WINDOW];
    private long tracked;
    private long drawn;
    private long seen;
    private long firstNs;
    private long lastNs;
    private final StringBuilder errors = new StringBuilder();

    synchronized void tracked(long nanoseconds, boolean visible) {
        trackMs[(int) (tracked++ % WINDOW)] = nanoseconds * 1e-6f;
        if (visible) seen++;
        lastNs = System.nanoTime();
        if (firstNs == 0) firstNs = lastNs;
    }

    synchronized void drawn(long nanoseconds) {
        drawMs[(int) (drawn++ % WINDOW)] = nanoseconds * 1e-6f;
    }

    synchronized void error(String text) {
        if (errors.length() > 4000) errors.delete(0, 2000);
        errors.append(text).append('\n');
    }

    synchronized long frames() {
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
    synchronized String text() {
        int version = Native.version();
        double seconds = (lastNs - firstNs) * 1e-9;
        StringBuilder out = new StringBuilder();
        line(out, "phone", Build.MANUFACTURER + " " + Build.MODEL + ", Android " + Build.VERSION.RELEASE + " (API "
                + Build.VERSION.SDK_INT + ")");
        line(out, "modar", version / 10000 + "." + version / 100 % 100 + "." + version % 100);
        line(out, "gl", gl);
        line(out, "profile", profile);
        line(out, "bundle", bundle);
        line(out, "release", release);
        line(out, "camera", camera);
        line(out, "frames", tracked + ", a pattern seen in " + seen + ", drawn " + drawn);
        line(out, "frames a second", seconds > 0 ? number((tracked - 1) / seconds) : "-");
        line(out, "tracking ms", times(trackMs, tracked));
        line(out, "drawing ms", times(drawMs, drawn));
        line(out, "gl memory kB", String.valueOf(gpuBytes / 1000));
        line(out, "errors", errors.length() == 0 ? "none" : "\n" + errors);
        return out.toString();
    }

    private static void line(StringBuilder out, String name, String value) {
        out.append(name).append(": ").append(value).append('\n');
    }

    private static String number(double value) {
        return String.format(Locale.ROOT, "%.1f", value);
    }

    /** Median and 95th percentile. */
    private static String times(float[] ms, long count) {
        int length = (int) Math.min(count, ms.length);
        if (length == 0) return "-";
        float[] sorted = Arrays.copyOf(ms, length);
        Arrays.sort(sorted);
        return number(sorted[length / 2]) + ", 95 % within " + number(sorted[length * 95 / 100]);
    }
}

package org.modar;

import android.hardware.SensorManager;
import fake.GlContext;
import java.io.FileInputStream;
import java.io.FileOutputStream;
import java.lang.management.ManagementFactory;
import java.nio.ByteBuffer;
import java.nio.ByteOrder;
import java.nio.channels.FileChannel;
import java.nio.file.Files;
import java.nio.file.Paths;
import java.util.ArrayList;
import java.util.Arrays;
import java.util.List;
import java.util.concurrent.atomic.AtomicInteger;
import java.util.concurrent.atomic.AtomicReference;
import java.util.regex.Matcher;
import java.util.regex.Pattern;
import javax.management.ObjectName;

/** Drives org.modar.Native as the app does, without android.*: what android_test.py asks for. */
public final class BridgeRun {
    private static byte[][] frames;
    private static int width;
    private static int height;

    public static void main(String[] words) throws Exception {
        width = Integer.parseInt(words[3]);
        height = Integer.parseInt(words[4]);
        byte[] all = Files.readAllBytes(Paths.get(words[2]));
        frames = new byte[all.length / (width * height * 3 / 2)][width * height * 3 / 2];
        for (int i = 0; i < frames.length; i++)
            System.arraycopy(all, i * frames[i].length, frames[i], 0, frames[i].length);
        switch (words[0]) {
            case "poses":
                poses(words[1], words[5], words.length > 6 ? words[6] : "");
                break;
            case "gyroscope":
                gyroscope(words[5], words[6]);
                break;
            case "handover":
                handover();
                break;
            case "pictures":
                pictures(words[1], words[5]);
                break;
            case "misuse":
                misuse(words[1], words[5]);
                break;
            case "close":
                closeWhileBusy(words[1]);
                break;
            case "texts":
                texts(words[1]);
                break;
            case "focal":
                focal(words[1]);
                break;
            case "clips":
                clips(words[1]);
                break;
            case "acts":
                acts(words[1], words[5], Integer.parseInt(words[6]));
                break;
            default:
                soak(words[1], Integer.parseInt(words[5]));
        }
    }

    private static final class CountedFrame extends Frame {
        final AtomicInteger released = new AtomicInteger();

        CountedFrame() {
            super(1);
        }

        @Override
        int track(long session) {
            return 0;
        }

        @Override
        void draw(long session) {}

        @Override
        void release() {
            released.incrementAndGet();
        }
    }

    /** While a frame is drawn, who wants it sleeps: a busy or locked thread has another state. */
    private static void handover() throws Exception {
        FrameHandover frames = new FrameHandover();
        CountedFrame early = new CountedFrame(), drawn = new CountedFrame(), late = new CountedFrame();
        frames.put(early);
        frames.put(drawn);
        check(early.released.get() == 1, "a frame that nobody drew");
        check(frames.take() == drawn, "the newest frame");
        List<Thread> callers = new ArrayList<>();
        for (int i = 0; i < 3; i++) {
            Thread caller = new Thread(frames::drop);
            callers.add(caller);
            caller.start();
            for (int ms = 0; caller.getState() != Thread.State.WAITING && ms < 10_000; ms++) Thread.sleep(1);
            check(caller.getState() == Thread.State.WAITING, "caller " + i + " is " + caller.getState());
        }
        frames.put(late); // the camera waits for nobody
        check(drawn.released.get() == 0 && late.released.get() == 0, "a frame that is drawn stays");
        frames.done();
        for (Thread caller : callers) caller.join(10_000);
        check(drawn.released.get() == 1 && late.released.get() == 1, "each frame goes back once");
        check(frames.take() == null, "no frame is left");
        frames.put(early);
        frames.done();
        check(frames.take() == early && early.released.get() == 1, "the next one");
        frames.done();
        check(frames.take() == early, "it is shown until a newer one comes");
    }

    /**
     * The frames as a camera of 30 a second gives them, with the app's own players: commands of
     * each frame, the fake decoder's commands, and the middle of each picture.
     */
    private static void acts(String bundle, String out, int lasts) throws Exception {
        long session = opened(bundle);
        GlContext.create(width, height);
        Native.onSurfaceCreated(session, "mali400");
        Native.onSurfaceChanged(session, width, height, 0, false);
        Media media = new Media(session, new java.io.File(out), () -> {});
        android.media.MediaPlayer.lasts = lasts;
        Poses poses = new Poses(1);
        ByteBuffer rgba = ByteBuffer.allocateDirect(4 * width * height);
        for (int i = 0; i < frames.length; i++) {
            Native.onCameraFrame(session, frames[i], i / 30.0, poses.bytes);
            if (i > 0) android.media.MediaPlayer.pass(1000 / 30.0);
            media.tellEnded();
            int[] commands = Native.act(session, i / 30.0, poses.bytes);
            StringBuilder line = new StringBuilder("{\"frame\": " + i + ", \"commands\": [");
            for (int k = 0; commands != null && k < commands.length; k += 3) {
                line.append(k == 0 ? "" : ", ").append("[" + commands[k] + ", " + commands[k + 1] + "]");
                if (commands[k] == Native.LINK)
                    check(Native.address(session, commands[k + 2]).startsWith("https://"), "an address");
            }
            if (commands != null) media.execute(commands);
            media.upload();
            Native.onDrawFrame(session, frames[i], poses.bytes, false);
            GlContext.read(rgba);
            line.append("], \"told\": \"" + android.media.MediaPlayer.log.toString().trim() + "\", \"caption\": \""
                    + media.caption("en"));
            android.media.MediaPlayer.log.setLength(0);
            line.append("\", \"at\": "
                    + (android.media.MediaPlayer.all.isEmpty() ? -1 : android.media.MediaPlayer.all.get(0).at));
            if (poses.visible(0) && poses.shown(0)) {
                // A little from the pattern's middle to its top left corner: the fake's pictures have their colour there.
                double px = 0, py = 0;
                for (int k = 0; k < 4; k++) {
                    double share = 0.25 * 0.85 + (k == 0 ? 0.15 : 0);
                    px += share * poses.get(0, Poses.CORNERS + 2 * k);
                    py += share * poses.get(0, Poses.CORNERS + 2 * k + 1);
                }
                int from = 4 * ((height - 1 - (int) py) * width + (int) px);
                pointed(session, poses, frames[i], i % 8);
                line.append(", \"pixel\": [" + (rgba.get(from) & 255) + ", " + (rgba.get(from + 1) & 255) + ", "
                        + (rgba.get(from + 2) & 255) + "]");
            }
            System.out.println(line + "}");
        }
        check(android.media.MediaPlayer.all.get(0).bytes > 1000 && android.media.MediaPlayer.all.get(0).volume == 0,
                "a silent film");
        Native.press(session, Native.PRESS_SOUND);
        media.follow();
        check(android.media.MediaPlayer.all.get(0).volume == 1, "sound");
        check(media.transcript(0, "en").equals("One & only"), "a transcript");
        media.close();
        check(android.media.MediaPlayer.all.isEmpty() && new java.io.File(out).list().length == 0, "all is given back");
        Native.close(session);
    }

    /** The film's label is where the cover's diagonals cross, however the screen shows the frame. */
    private static void pointed(long session, Poses poses, byte[] frame, int way) throws Exception {
        int[] about = Native.node(session, 0);
        int label = 0;
        while (about[Native.KIND] != Native.LABEL) about = Native.node(session, ++label);
        check(Native.mark(session, label).equals("1"), "a mark: " + Native.mark(session, label));
        float[] c = new float[8];
        for (int k = 0; k < 8; k++) c[k] = poses.get(0, Poses.CORNERS + k);
        double ax = c[4] - c[0], ay = c[5] - c[1], bx = c[6] - c[2], by = c[7] - c[3];
        double along = ((c[2] - c[0]) * by - (c[3] - c[1]) * bx) / (ax * by - ay * bx);
        double x = c[0] + along * ax + 0.5 - width / 2.0, y = c[1] + along * ay + 0.5 - height / 2.0;
        int screenWidth = way % 2 == 0 ? 320 : 200, screenHeight = way % 2 == 0 ? 200 : 400, degrees = 90 * (way % 4);
        Native.onSurfaceChanged(session, screenWidth, screenHeight, degrees, way > 3);
        Native.onDrawFrame(session, frame, poses.bytes, false);
        for (int turn = 0; turn < degrees; turn += 90) { // clockwise, y down
            double before = x;
            x = -y;
            y = before;
        }
        boolean lies = degrees % 180 != 0;
        double scale = Math.max(
                (double) screenWidth / (lies ? height : width), (double) screenHeight / (lies ? width : height));
        float[] at = new float[3];
        check(Native.label(session, label, false, at), "a label is seen");
        double off = Math.hypot(
                at[0] - screenWidth / 2.0 - (way > 3 ? -x : x) * scale, at[1] - screenHeight / 2.0 - y * scale);
        check(off < 0.5, "the label is off by " + off + " in way " + way);
        check(!Native.label(session, label - 1, false, at), "no label");
        Native.onSurfaceChanged(session, width, height, 0, false);
    }

    private static long opened(String bundle) throws Exception {
        long session = Native.openFile(bundle);
        Native.setCamera(session, width, height, null, 0, false, false);
        return session;
    }

    /** A frame's luma with `padding` bytes behind each row, in a direct buffer. */
    private static ByteBuffer luma(byte[] frame, int padding) {
        int stride = width + padding;
        ByteBuffer plane = ByteBuffer.allocateDirect(stride * (height - 1) + width);
        for (int y = 0; y < height; y++) {
            plane.position(y * stride);
            plane.put(frame, y * width, width);
        }
        plane.rewind();
        return plane;
    }

    /** V, U, V, U... as the two overlapping planes of an Image: {u, v}. */
    private static ByteBuffer[] pairs(byte[] frame, int padding, boolean nv12) {
        int stride = width + padding;
        ByteBuffer both = ByteBuffer.allocateDirect(stride * (height / 2 - 1) + width);
        for (int y = 0; y < height / 2; y++) {
            for (int x = 0; x < width; x++) {
                both.put(y * stride + x, frame[width * height + y * width + (nv12 ? x ^ 1 : x)]);
            }
        }
        both.limit(both.capacity() - 1);
        ByteBuffer first = both.slice();
        both.limit(both.capacity());
        both.position(1);
        ByteBuffer second = both.slice();
        return nv12 ? new ByteBuffer[] {first, second} : new ByteBuffer[] {second, first};
    }

    /** One plane of chroma apart. */
    private static ByteBuffer apart(byte[] frame, int offset, int padding) {
        int stride = width / 2 + padding;
        ByteBuffer plane = ByteBuffer.allocateDirect(stride * height / 2);
        for (int y = 0; y < height / 2; y++) {
            for (int x = 0; x < width / 2; x++) {
                plane.put(y * stride + x, frame[width * height + y * width + 2 * x + offset]);
            }
        }
        return plane;
    }

    private static void check(boolean good, String what) {
        if (!good) throw new AssertionError(what);
    }

    /**
     * All floats of all frames; once as arrays, once as planes with padding, which must be the same. turns: a file with
     * a line a frame for Native.onTurn(), and `extended`; empty: without.
     */
    private static void poses(String bundle, String out, String turns) throws Exception {
        long arrays = opened(bundle);
        List<String> lines = turns.isEmpty() ? null : Files.readAllLines(Paths.get(turns));
        FileInputStream file = new FileInputStream(bundle);
        java.lang.reflect.Field number = java.io.FileDescriptor.class.getDeclaredField("fd");
        number.setAccessible(true);
        long planes = Native.openFd(number.getInt(file.getFD()), 0, file.getChannel().size());
        file.close(); // the mapping outlives it
        Native.setCamera(planes, width, height, null, 0, false, false);
        if (lines != null) {
            Native.setCamera(arrays, width, height, null, 0, false, true);
            Native.setCamera(planes, width, height, null, 0, false, true);
        }
        Native.verify(planes);
        int patterns = Native.patternCount(arrays);
        Poses a = new Poses(patterns);
        Poses b = new Poses(patterns);
        FileChannel sink = new FileOutputStream(out).getChannel();
        for (int i = 0; i < frames.length; i++) {
            if (lines != null) {
                turn(arrays, lines.get(i));
                turn(planes, lines.get(i));
            }
            int seen = Native.onCameraFrame(arrays, frames[i], i / 30.0, a.bytes);
            check(Native.onCameraPlane(planes, luma(frames[i], 17), width + 17, i / 30.0, b.bytes) == seen, "seen");
            a.bytes.rewind();
            b.bytes.rewind();
            check(a.bytes.equals(b.bytes), "array and plane");
            check(a.visible(0) == (seen > 0), "flag");
            sink.write(a.bytes);
            System.out.println(Native.reason(arrays));
            a.bytes.rewind();
        }
        sink.close();
        Native.close(arrays);
        Native.close(planes);
    }

    private static void turn(long session, String line) throws Exception {
        double[] numbers = numbers(line);
        Native.onTurn(session, numbers[0], numbers[1], numbers[2], (int) numbers[3], numbers[4] != 0);
    }

    private static double[] numbers(String line) {
        return Arrays.stream(line.split(" ")).mapToDouble(Double::parseDouble).toArray();
    }

    /** Readings of a file through a fake phone's gyroscope: the turn about x in each span of another file, or "unknown". */
    private static void gyroscope(String readings, String spans) throws Exception {
        check(Gyroscope.open(new SensorManager(), null) == null, "a phone without one");
        SensorManager.present = true;
        Gyroscope gyroscope = Gyroscope.open(new SensorManager(), null);
        for (String line : Files.readAllLines(Paths.get(readings))) {
            double[] numbers = numbers(line);
            SensorManager.read(Math.round(numbers[0] * 1e9), (float) numbers[1], 0, 0);
        }
        for (String line : Files.readAllLines(Paths.get(spans))) {
            double[] numbers = numbers(line);
            System.out.println(gyroscope.turn(numbers[0], numbers[1]) ? gyroscope.turned[0] : "unknown");
        }
        gyroscope.close();
        check(SensorManager.listener == null, "let go");
    }

    /** All texts of the first pattern as escaped UTF-16: language, text, alternative. */
    /** Two clips of two seconds; the scene loops the first. */
    private static void clips(String bundle) throws Exception {
        long session = Native.openFile(bundle);
        StringBuilder names = new StringBuilder();
        for (int i = 0; Native.clipModel(session, i) >= 0; i++) names.append(Native.clipName(session, i)).append(' ');
        check(names.toString().equals("walk wave "), "clips: " + names);
        throwsCode("android.index", () -> Native.clipName(session, 2));
        check(Native.clipPlaying(session, 0) == -1, "nothing plays before the pattern is found");
        Poses poses = new Poses(1);
        poses.show(0);
        double[] times = {0, 1.9, 2.1};
        for (double time : times) {
            Native.act(session, time, poses.bytes);
            check(Native.clipPlaying(session, 0) == 0, "the scene's clip at " + time);
        }
        check(!Native.playClip(session, 0, 2, true, 0.3), "a clip of no model");
        check(!Native.playClip(session, 1, 0, true, 0.3), "no scene");
        check(Native.playClip(session, 0, 1, false, 0.3), "the other");
        Native.act(session, 2.2, poses.bytes);
        check(Native.clipPlaying(session, 0) == 1, "the other plays: " + Native.clipPlaying(session, 0));
        Native.act(session, 4.5, poses.bytes);
        check(Native.clipPlaying(session, 0) == -1, "it has ended");
        check(Native.playClip(session, 0, 1, true, 0), "again");
        Native.act(session, 4.6, poses.bytes);
        Native.stopClip(session, 0);
        check(Native.clipPlaying(session, 0) == -1, "it was stopped");
        Native.close(session);
        System.out.println("played");
    }

    private static void texts(String bundle) throws Exception {
        long session = Native.openFile(bundle);
        check(Native.language(session, -1) == null && Native.patternText(session, 0, false, "xx") == null, "none");
        check(Native.patternText(session, 99, false, "en") == null, "no such pattern");
        String language;
        for (int i = 0; (language = Native.language(session, i)) != null; i++) {
            for (String text : new String[] {language, Native.patternText(session, 0, false, language),
                         Native.patternText(session, 0, true, language)}) {
                StringBuilder line = new StringBuilder();
                for (int at = 0; text != null && at < text.length(); at++)
                    line.append(String.format("%04x", (int) text.charAt(at)));
                System.out.println(text == null ? "none" : line);
            }
        }
        Native.close(session);
    }

    /** The knowledge of the lens after each frame, as a share of the frame's width. A session with a given lens begins with it. */
    private static void focal(String bundle) throws Exception {
        long session = opened(bundle);
        Poses poses = new Poses(Native.patternCount(session));
        for (int i = 0; i < frames.length; i++) {
            Native.onCameraFrame(session, frames[i], i / 30.0, poses.bytes);
            System.out.println(Native.focal(session));
        }
        double found = Native.focal(session);
        Native.trim(session);
        check(Native.focal(session) == 0, "no tracker");
        Native.setCamera(session, 2 * width, 2 * height, null, found, false, false);
        ByteBuffer matrix = ByteBuffer.allocateDirect(64).order(ByteOrder.nativeOrder());
        Native.projection(session, 0.5, 50, matrix);
        check(Math.abs(matrix.getFloat(0) - 2 * found) < 1e-6, "begins with it");
        Native.close(session);
    }

    private static final int NV21 = 0;
    private static final int PAIRS_NV21 = 1;
    private static final int PAIRS_NV12 = 2;
    private static final int PLANES = 3;

    /** All frames drawn once each, in a session and a context of their own, which is lost before frame `loss`. */
    private static ByteBuffer[] drawn(String bundle, int layout, int loss) throws Exception {
        GlContext.create(width, height);
        long session = opened(bundle);
        Poses poses = new Poses(Native.patternCount(session));
        Native.onSurfaceCreated(session, "mali400");
        Native.onSurfaceChanged(session, width, height, 0, false);
        check(Native.gpuBytes(session) > 0, "gpu bytes");
        ByteBuffer[] pictures = new ByteBuffer[frames.length];
        for (int i = 0; i < frames.length; i++) {
            byte[] frame = frames[i];
            if (i == loss) {
                // The context goes with all that was in it: the next frame comes from a new one.
                GlContext.destroy();
                GlContext.create(width, height);
                Native.onSurfaceCreated(session, "mali400");
            }
            Native.onCameraFrame(session, frame, i / 30.0, poses.bytes);
            if (layout == NV21) {
                Native.onDrawFrame(session, frame, poses.bytes, false);
            } else if (layout == PLANES) {
                Native.onDrawPlanes(session, luma(frame, 0), width, apart(frame, 1, 8), apart(frame, 0, 8),
                        width / 2 + 8, 1, poses.bytes, false);
            } else {
                ByteBuffer[] pair = pairs(frame, 32, layout == PAIRS_NV12);
                Native.onDrawPlanes(
                        session, luma(frame, 32), width + 32, pair[0], pair[1], width + 32, 2, poses.bytes, false);
            }
            pictures[i] = ByteBuffer.allocateDirect(4 * width * height);
            GlContext.read(pictures[i]);
        }
        if (layout == NV21) {
            // A frame that GL has is not read again.
            byte[] last = frames[frames.length - 1], other = last.clone();
            for (int i = 0; i < other.length; i++) other[i] ^= 64;
            ByteBuffer again = ByteBuffer.allocateDirect(4 * width * height);
            Native.onDrawFrame(session, other, poses.bytes, true);
            GlContext.read(again);
            check(off(pictures[frames.length - 1], again) < 3, "the same frame");
            Native.onDrawFrame(session, other, poses.bytes, false);
            GlContext.read(again);
            check(off(pictures[frames.length - 1], again) > 30, "another frame");
        }
        if (layout == PLANES) {
            check(Native.touch(session, 0, 5, width / 2, height / 2) == 0
                            && Native.touch(session, 1, 5, width, height / 2) == Native.MOVED
                            && Native.touch(session, 2, 5, width, height / 2) == 0,
                    "half around");
            Native.onDrawFrame(session, frames[frames.length - 1], poses.bytes, false);
            ByteBuffer moved = ByteBuffer.allocateDirect(4 * width * height);
            GlContext.read(moved);
            check(off(pictures[frames.length - 1], moved) > 30, "gesture");
        }
        Native.close(session);
        GlContext.destroy();
        return pictures;
    }

    /** The drawings of all frames, RGBA from the bottom up; every layout gives the same, and so does a new context. */
    private static void pictures(String bundle, String out) throws Exception {
        ByteBuffer[] wanted = drawn(bundle, NV21, -1);
        FileChannel sink = new FileOutputStream(out).getChannel();
        for (ByteBuffer each : wanted) sink.write(each);
        sink.close();
        for (int layout = PAIRS_NV21; layout <= PLANES; layout++) {
            ByteBuffer[] others = drawn(bundle, layout, -1);
            for (int i = 0; i < frames.length; i++) {
                // Mesa rounds a mix of chroma's two values by their order.
                check(off(wanted[i], others[i]) <= 1, "layout " + layout + " of frame " + i);
            }
        }
        // The light that the renderer has learnt outlives the context.
        ByteBuffer[] others = drawn(bundle, NV21, frames.length / 2);
        for (int i = 0; i < frames.length; i++) check(off(wanted[i], others[i]) == 0, "frame " + i + " after a loss");
    }

    /** The greatest difference of two pictures' values. */
    private static int off(ByteBuffer a, ByteBuffer b) {
        int most = 0;
        for (int i = 0; i < a.capacity(); i++) most = Math.max(most, Math.abs((a.get(i) & 0xFF) - (b.get(i) & 0xFF)));
        return most;
    }

    private interface Call {
        void run() throws Exception;
    }

    private static void throwsCode(String code, Call call) throws Exception {
        try {
            call.run();
        } catch (ModarException error) {
            check(error.code.equals(code), code + " but " + error.code);
            check(error.status > 0 && !error.cause.isEmpty() && !error.cure.isEmpty(), "parts of " + code);
            return;
        }
        throw new AssertionError("nothing was thrown: " + code);
    }

    private static void misuse(final String bundle, final String damaged) throws Exception {
        final long session = Native.openFile(bundle);
        final Poses poses = new Poses(Native.patternCount(session));
        final ByteBuffer small = ByteBuffer.allocateDirect(8);
        final ByteBuffer heap = ByteBuffer.allocate(1 << 20);
        final ByteBuffer plane = luma(frames[0], 0);
        throwsCode("io.open", () -> Native.openFile("none.modar"));
        throwsCode("io.open", () -> Native.openFile(null));
        throwsCode("io.map", () -> Native.openFd(-1, 0, 100));
        throwsCode("io.range", () -> Native.openFd(0, -1, 100));
        throwsCode("bundle.truncated", () -> Native.openFile(damaged));
        throwsCode("android.camera", () -> Native.onCameraFrame(session, frames[0], 0, poses.bytes));
        throwsCode("android.camera", () -> Native.reason(session));
        throwsCode("android.camera", () -> Native.onTurn(session, 0, 0, 0, 90, false));
        throwsCode("camera.size", () -> Native.setCamera(session, 0, 480, null, 0, false, false));
        throwsCode("camera.open", () -> Native.setCamera(session, width, height, "none.yml", 0, false, false));
        Native.setCamera(session, width, height, null, 0, false, false);
        throwsCode("android.buffer", () -> Native.onCameraFrame(session, null, 0, poses.bytes));
        throwsCode("android.buffer", () -> Native.onCameraFrame(session, new byte[9], 0, poses.bytes));
        throwsCode("android.buffer", () -> Native.onCameraFrame(session, frames[0], 0, null));
        throwsCode("android.buffer", () -> Native.onCameraFrame(session, frames[0], 0, small));
        throwsCode("android.buffer", () -> Native.onCameraFrame(session, frames[0], 0, heap));
        throwsCode("android.buffer", () -> Native.onCameraPlane(session, small, width, 0, poses.bytes));
        throwsCode("android.planes", () -> Native.onCameraPlane(session, plane, width - 1, 0, poses.bytes));
        throwsCode("android.buffer", () -> Native.onCameraPlane(session, plane, Integer.MAX_VALUE, 0, poses.bytes));
        throwsCode("android.buffer", () -> Native.projection(session, 0.1, 10, small));
        throwsCode("android.surface", () -> Native.onDrawFrame(session, frames[0], poses.bytes, false));
        throwsCode("android.surface", () -> Native.pick(session, 1, 1));
        check(Native.focal(session) == 0, "no frames, no focal length");
        throwsCode("android.surface", () -> Native.onDrawOrbit(session, 0, 0));
        throwsCode("android.index", () -> Native.patternName(session, 99));
        throwsCode("android.index", () -> Native.modelName(session, -1));
        GlContext.create(width, height);
        throwsCode("device.unknown", () -> Native.onSurfaceCreated(session, "nokia"));
        Native.onSurfaceCreated(session, null);
        Native.onSurfaceChanged(session, width, height, 90, true);
        ByteBuffer[] pair = pairs(frames[0], 0, false);
        throwsCode("android.buffer", () -> Native.onDrawFrame(session, new byte[width * height], poses.bytes, false));
        throwsCode("android.planes",
                () -> Native.onDrawPlanes(session, plane, 1, pair[0], pair[1], width, 2, poses.bytes, false));
        throwsCode("android.planes",
                () -> Native.onDrawPlanes(session, plane, width, pair[0], pair[1], width, 3, poses.bytes, false));
        throwsCode("android.buffer",
                () -> Native.onDrawPlanes(session, plane, width, pair[0], small, width, 2, poses.bytes, false));
        Native.onDrawFrame(session, frames[0], poses.bytes, false); // still as good as new
        // Samples of U and V that are neither planar nor interleaved.
        Native.onDrawPlanes(session, plane, width, pair[0], plane, width, 2, poses.bytes, false);
        ByteBuffer matrix = ByteBuffer.allocateDirect(64).order(ByteOrder.nativeOrder());
        Native.projection(session, 0.5, 50, matrix);
        // Focal length = width: the frame's sides are seen at x/z = 0.5.
        check(Math.abs(matrix.getFloat(0) - 2) < 1e-6, "projection");
        Native.close(session);
        Native.close(session);
        for (final long closed : new long[] {session, 0, -1, Long.MAX_VALUE}) {
            throwsCode("android.closed", () -> Native.onCameraFrame(closed, frames[0], 0, poses.bytes));
            throwsCode("android.closed", () -> Native.onCameraPlane(closed, plane, width, 0, poses.bytes));
            throwsCode("android.closed", () -> Native.onDrawFrame(closed, frames[0], poses.bytes, false));
            throwsCode("android.closed", () -> Native.onSurfaceCreated(closed, null));
            throwsCode("android.closed", () -> Native.onSurfaceChanged(closed, 1, 1, 0, false));
            throwsCode("android.closed", () -> Native.setCamera(closed, 4, 4, null, 0, false, false));
            throwsCode("android.closed", () -> Native.touch(closed, 0, 0, 0, 0));
            throwsCode("android.closed", () -> Native.lookAround(closed, 0, 0, true));
            throwsCode("android.closed", () -> Native.waiting(closed));
            throwsCode("android.closed", () -> Native.clipModel(closed, 0));
            throwsCode("android.closed", () -> Native.playClip(closed, 0, 0, true, 0));
            throwsCode("android.closed", () -> Native.stopClip(closed, 0));
            throwsCode("android.closed", () -> Native.clipPlaying(closed, 0));
            throwsCode("android.closed", () -> Native.press(closed, 0));
            throwsCode("android.closed", () -> Native.status(closed));
            throwsCode("android.closed", () -> Native.patternCount(closed));
            throwsCode("android.closed", () -> Native.patternName(closed, 0));
            throwsCode("android.closed", () -> Native.reason(closed));
            throwsCode("android.closed", () -> Native.verify(closed));
            throwsCode("android.closed", () -> Native.reset(closed));
            throwsCode("android.closed", () -> Native.onTurn(closed, 0, 0, 0, 0, true));
            throwsCode("android.closed", () -> Native.pick(closed, 0, 0));
            throwsCode("android.closed", () -> Native.onDrawOrbit(closed, 0, 0));
            throwsCode("android.closed", () -> Native.focal(closed));
            throwsCode("android.closed", () -> Native.trim(closed));
            throwsCode("android.closed", () -> Native.language(closed, 0));
            throwsCode("android.closed", () -> Native.patternText(closed, 0, true, "en"));
            throwsCode("android.closed", () -> Native.gpuBytes(closed));
            throwsCode("android.closed", () -> Native.projection(closed, 1, 2, matrix));
        }
        GlContext.destroy();
        System.out.println("all thrown");
    }

    /** One thread tracks, one draws, a third closes: both end with "android.closed". */
    private static void closeWhileBusy(final String bundle) throws Exception {
        for (int round = 0; round < 5; round++) {
            final long session = opened(bundle);
            final AtomicReference<Throwable> wrong = new AtomicReference<>();
            final Call track = () -> {
                Poses poses = new Poses(Native.patternCount(session));
                for (int i = 0;; i++) Native.onCameraFrame(session, frames[i % frames.length], i, poses.bytes);
            };
            final Call draw = () -> {
                GlContext.create(width, height);
                Poses poses = new Poses(Native.patternCount(session));
                Native.onSurfaceCreated(session, null);
                Native.onSurfaceChanged(session, width, height, 0, false);
                for (int i = 0;; i++) Native.onDrawFrame(session, frames[i % frames.length], poses.bytes, false);
            };
            Thread[] threads = new Thread[2];
            for (int i = 0; i < 2; i++) {
                final Call call = i == 0 ? track : draw;
                threads[i] = new Thread(() -> {
                    try {
                        throwsCode("android.closed", call);
                    } catch (Throwable other) {
                        wrong.set(other);
                    }
                    if (call == draw) GlContext.destroy();
                });
                threads[i].start();
            }
            Thread.sleep(100 + 40 * round);
            Native.close(session);
            for (Thread thread : threads) thread.join();
            if (wrong.get() != null) throw new AssertionError(wrong.get());
        }
        System.out.println("closed");
    }

    /** Resident kilobytes of this process. */
    private static long resident() throws Exception {
        for (String line : Files.readAllLines(Paths.get("/proc/self/status"))) {
            if (line.startsWith("VmRSS:")) return Long.parseLong(line.replaceAll("[^0-9]", ""));
        }
        return 0;
    }

    private static long heap() {
        for (int i = 0; i < 3; i++) System.gc();
        return Runtime.getRuntime().totalMemory() - Runtime.getRuntime().freeMemory();
    }

    /** Global and weak references that native code holds, as the machine itself counts them. */
    private static long references() throws Exception {
        String threads = (String) ManagementFactory.getPlatformMBeanServer().invoke(
                new ObjectName("com.sun.management:type=DiagnosticCommand"), "threadPrint",
                new Object[] {new String[0]}, new String[] {String[].class.getName()});
        Matcher counted = Pattern.compile("JNI global refs: (\\d+), weak refs: (\\d+)").matcher(threads);
        check(counted.find(), "the machine's count of references");
        return Long.parseLong(counted.group(1)) + Long.parseLong(counted.group(2));
    }

    /**
     * Frames through both halves; prints by how much heap, resident kilobytes and JNI references
     * grew in the second half of them. The drawing is small: its pixels cost most of a frame in
     * Mesa, and hold nothing.
     */
    private static void soak(String bundle, int count) throws Exception {
        int across = width / 8;
        int down = height / 8;
        GlContext.create(across, down);
        long session = opened(bundle);
        Poses poses = new Poses(Native.patternCount(session));
        Native.onSurfaceCreated(session, null);
        Native.onSurfaceChanged(session, across, down, 0, false);
        ByteBuffer luma = luma(frames[0], 0);
        long heap = 0;
        long resident = 0;
        long references = 0;
        for (int i = 0; i < count; i++) {
            if (i == count / 2) {
                references = references();
                heap = heap();
                resident = resident();
            }
            byte[] frame = frames[i % frames.length];
            if (i % 2 == 0) {
                Native.onCameraFrame(session, frame, i / 30.0, poses.bytes);
            } else {
                luma.position(0);
                luma.put(frame, 0, width * height);
                Native.onCameraPlane(session, luma, width, i / 30.0, poses.bytes);
            }
            Native.onDrawFrame(session, frame, poses.bytes, false);
        }
        System.out.println((heap() - heap) + " " + (resident() - resident) + " " + (references() - references));
        Native.close(session);
        GlContext.destroy();
    }
}

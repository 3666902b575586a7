package org.modar;

import android.app.Activity;
import android.content.Context;
import android.content.res.AssetManager;
import android.graphics.Bitmap;
import android.hardware.Camera;
import android.hardware.SensorManager;
import android.hardware.camera2.CameraDevice;
import android.hardware.camera2.CameraManager;
import android.media.ImageReader;
import android.opengl.GLSurfaceView;
import android.os.Handler;
import android.view.MotionEvent;
import android.view.View;
import android.widget.TextView;
import java.io.File;
import java.nio.ByteBuffer;
import java.nio.file.Files;
import java.nio.file.Path;
import java.nio.file.Paths;

/** A day of the app's, in a JVM: frames of a clip, and what happens to phones. Each step checks what the screen says. */
public final class AppRun {
    private static byte[] clip;
    private static int size;
    private static MainActivity app;
    private static GLSurfaceView view;

    /** words: APK, clip, width, height, the app's folder, where to put the last picture, the layout, a second clip; for releases, a folder. */
    public static void main(String[] words) throws Exception {
        AssetManager.apk = words[0];
        clip = Files.readAllBytes(Paths.get(words[1]));
        Camera.width = Integer.parseInt(words[2]);
        Camera.height = Integer.parseInt(words[3]);
        size = Camera.width * Camera.height * 3 / 2;
        Context.folder = new File(words[4]);
        Activity.layout = new File(words[6]);
        Activity.numbers = R.id.class;
        Stage.searchApart = false;

        if (words[7].equals("scene")) {
            scene();
            videos();
            System.out.println("the day is over");
            return;
        }
        if (words[7].equals("own")) {
            own(words[8]);
            System.out.println("the day is over");
            return;
        }
        if (words[7].equals("first")) {
            first(Paths.get(words[8]));
            System.out.println("the day is over");
            return;
        }
        if (words.length > 8) {
            network(Paths.get(words[8]));
            System.out.println("the day is over");
            return;
        }
        permission();
        withoutPermission();
        frames(words[5]);
        camera2();
        gyroscope(words[7]);
        fingers();
        pauses();
        around(words[5]);
        memory();
        pictures();
        german();
        damage();
        AssetManager.apk = words[0];
        rot();
        update();
        System.out.println("the day is over");
    }

    private static void check(boolean good, String what) {
        if (!good) throw new AssertionError(what + "; the screen says: " + status());
    }

    /** The line of advice. */
    private static String status() {
        Handler.pump();
        return ((TextView) app.findViewById(R.id.status)).text;
    }

    private static void click(int button) {
        app.findViewById(button).click();
    }

    private static void start() throws Exception {
        app = new MainActivity();
        app.onCreate(null);
        view = GLSurfaceView.last;
        app.onResume();
        view.surface(Camera.width, Camera.height, true);
        view.frame();
        Handler.pump();
    }

    /** Frame `index` of the clip through camera, tracker and GL; false where the app takes none. */
    private static boolean deliver(int index) {
        byte[] frame = new byte[size];
        System.arraycopy(clip, index * size, frame, 0, size);
        boolean taken = android.os.Build.VERSION.SDK_INT >= 21 && CameraManager.full
                ? ImageReader.current.deliver(frame)
                : Camera.current.deliver(frame);
        view.frame();
        return taken;
    }

    /** All frames once, from a camera that was opened anew: the last picture. */
    /** Over the camera's picture: the bundle's pictures, and bundles of other apps next to it. */
    private static void lists() throws Exception {
        check(gone(R.id.menu_models), "one bundle has no list");
        click(R.id.menu_patterns);
        android.app.AlertDialog.Builder list = android.app.AlertDialog.shown;
        check(list.title.equals("Choose a picture to look at") && list.items.length == 1
                        && list.items[0].equals("cover"),
                "the bundle's pictures, without the visitor's own");
        list.chosen.onClick(null, 0);
        check(gone(R.id.menu) && Camera.opened == 0, "looked at without the camera");
        app.onBackPressed();
        click(R.id.menu_open);
        check(Activity.wanted.type.equals("*/*"), "any file");
        File plain = new File(Context.folder, "notes.txt");
        Files.write(plain.toPath(), new byte[100]);
        app.onActivityResult(
                3, Activity.RESULT_OK, new android.content.Intent("", new android.net.Uri(plain.getPath())));
        check(status().startsWith("The models cannot be read") && !new File(Context.folder, "notes.modar").exists()
                        && !new File(Context.folder, "notes.part").exists(),
                "no bundle");
        String asset = new AssetManager().list("bundles")[0];
        File given = new File(Context.folder, "gallery/another.modar");
        given.getParentFile().mkdirs();
        Files.write(given.toPath(), new AssetManager().open("bundles/" + asset).readAllBytes());
        app.onActivityResult(
                3, Activity.RESULT_OK, new android.content.Intent("", new android.net.Uri(given.getPath())));
        check(gone(R.id.menu) && told().contains("another (folder)"), "the other bundle is shown");
        app.onBackPressed();
        click(R.id.menu_models);
        list = android.app.AlertDialog.shown;
        check(list.title.equals("Choose a model") && list.items.length == 2 && list.items[0].equals("another"),
                "two bundles");
        list.chosen.onClick(null, 1);
        check(gone(R.id.menu) && told().contains("(app)") && Camera.opened == 1, "the app's own again");
        new File(Context.folder, "another.modar").delete();
        app.onBackPressed();
    }

    /** A photo that its EXIF turns: red at the top left, green at the top right, blue below. */
    private static void upright(String photo) throws Exception {
        app.onActivityResult(2, Activity.RESULT_OK, new android.content.Intent("", new android.net.Uri(photo)));
        shown(R.id.own);
        android.graphics.Bitmap read = drawn().bitmap;
        int width = read.getWidth(), height = read.getHeight();
        check(width == 160 && height == 96, photo + ": " + width + "x" + height);
        int[] pixels = new int[width * height];
        read.getPixels(pixels, 0, width, 0, 0, width, height);
        int[] at = {20 * width + 20, 20 * width + 140, 76 * width + 20, 76 * width + 140};
        int[] shift = {16, 8, 0, 0};
        for (int i = 0; i < 4; i++) {
            for (int channel = 0; channel <= 16; channel += 8) {
                int value = pixels[at[i]] >> channel & 255;
                check(channel == shift[i] ? value > 200 : value < 60,
                        photo + ": " + Integer.toHexString(pixels[at[i]]) + " at " + i);
            }
        }
        app.onBackPressed();
    }

    private static byte[] shown() throws Exception {
        for (int i = 0; i < clip.length / size; i++) check(deliver(i), "frame " + i);
        return picture();
    }

    /** The same frames through Camera2 give the same picture; another app may take the camera. */
    private static void camera2() throws Exception {
        app.onPause();
        app.onResume();
        byte[] old = shown();
        app.onPause();
        CameraManager.full = true;
        app.onResume();
        check(Camera.opened == 0 && CameraDevice.current.running, "Camera2");
        check(changed(old, shown()) == 0, "the same picture by Camera2");
        for (int i = 0; i < 40; i++) check(deliver(i % 2), "round " + i);
        check(ImageReader.current.open <= 2, "images go back");
        CameraDevice.current.callback.onDisconnected(CameraDevice.current);
        check(status().contains("another app took the camera"), "disconnected");
        check(!deliver(0), "no frame from a camera that is gone");
        app.onPause();
        check(ImageReader.current.closed && ImageReader.current.open == 0, "all images are back");
        app.onResume();
        check(deliver(0) && deliver(1), "continues with Camera2");
        app.onPause();
        CameraManager.full = false;
        app.onResume();
        shown();
    }

    /**
     * Something comes over the cover while the camera goes along: a gyroscope at rest changes nothing of where the model
     * stays, one that turns does. The phone's other cameras have clocks of their own.
     */
    private static void gyroscope(String covered) throws Exception {
        byte[] before = clip;
        clip = Files.readAllBytes(Paths.get(covered));
        CameraManager.full = true;
        byte[][] last = new byte[3][];
        for (int i = 0; i < 3; i++) {
            SensorManager.present = i > 0;
            SensorManager.rate = i > 1 ? 10 : 0;
            app.onPause();
            check(SensorManager.listener == null, "the gyroscope is let go");
            app.onResume();
            check((SensorManager.listener != null) == SensorManager.present, "the gyroscope is listened to");
            for (int frame = 0; frame < 22; frame++) check(deliver(frame), "frame " + frame);
            last[i] = picture();
        }
        check(changed(last[0], last[1]) < 0.03, "at rest: " + changed(last[0], last[1]));
        check(changed(last[1], last[2]) > 0.05, "turned: " + changed(last[1], last[2]));
        CameraManager.realtime = false;
        app.onPause();
        app.onResume();
        check(SensorManager.listener == null, "another clock");
        app.onPause();
        CameraManager.full = false;
        clip = before;
        app.onResume();
        check(SensorManager.listener == null, "the old camera does not say when");
        shown();
    }

    /** Refused: it says so and opens no camera; a touch asks again; allowed, frames flow. */
    private static void permission() throws Exception {
        android.os.Build.VERSION.SDK_INT = 23;
        // Camera2 is not there in this fake: the old camera serves.
        Activity.allowed = false;
        start();
        check(Activity.asked == 1 && Camera.opened == 0, "asked once");
        app.onRequestPermissionsResult(1, new String[1], new int[] {-1});
        check(status().startsWith("This app shows models"), "why the camera");
        view.touch(new MotionEvent(MotionEvent.ACTION_DOWN, 5, 5));
        view.touch(new MotionEvent(MotionEvent.ACTION_UP, 5, 5));
        check(Activity.asked == 2, "asked again");
        Activity.allowed = true;
        app.onRequestPermissionsResult(1, new String[1], new int[] {0});
        check(Camera.opened == 1, "opened");
        check(status().startsWith("Point the camera at: cover"), "what to look for");
    }

    /** The clip: the text of the pattern while it is seen; the last picture goes to a file. */
    private static void frames(String out) throws Exception {
        boolean seen = false;
        for (int i = 0; i < clip.length / size; i++) {
            check(deliver(i), "frame " + i);
            app.onResume(); // a resume more does no harm
            Handler.pump();
            seen |= status().equals("Found in 1922.");
        }
        check(seen, "the text of the pattern");
        Files.write(Paths.get(out), picture());
        // Ten times round: nothing is held back.
        for (int i = 0; i < 10 * 4; i++) check(deliver(i % (clip.length / size)), "round " + i);
    }

    private static byte[] picture() {
        ByteBuffer rgba = ByteBuffer.allocateDirect(4 * Camera.width * Camera.height);
        fake.GlContext.read(rgba);
        byte[] pixels = new byte[rgba.capacity()];
        rgba.get(pixels);
        return pixels;
    }

    /** The share of values that differ plainly from another picture's. */
    private static double changed(byte[] before, byte[] after) {
        int far = 0;
        for (int i = 0; i < before.length; i++) {
            if (Math.abs((before[i] & 0xFF) - (after[i] & 0xFF)) > 30) far++;
        }
        return (double) far / before.length;
    }

    private static android.media.MediaPlayer film() {
        return android.media.MediaPlayer.all.get(0);
    }

    private static android.widget.Button mark() {
        Handler.pump();
        return (android.widget.Button) ((android.view.ViewGroup) app.findViewById(R.id.marks)).children.get(0);
    }

    /** A scene that acts, as the screen shows it: frames with the cover first, then without it. */
    private static void scene() throws Exception {
        android.media.MediaPlayer.lasts = 2000;
        start();
        for (int i = 0; i < 4; i++) check(deliver(i), "frame " + i);
        check(app.findViewById(R.id.sound).getVisibility() == android.view.View.VISIBLE, "a button for sound");
        check(film().isPlaying() && film().volume == 0, "a silent film");
        android.media.MediaPlayer.pass(200);
        Handler.pump();
        check(((TextView) app.findViewById(R.id.caption)).text.equals("One & only"), "the caption");
        android.widget.Button mark = mark();
        check(mark.visibility == android.view.View.VISIBLE && mark.text.equals("1")
                        && mark.described.equals("1: A note"),
                "a mark: " + mark.described);
        check(mark.x > 0 && mark.x < Camera.width && mark.y > 0 && mark.y < Camera.height && mark.alpha == 1,
                "on the picture");
        mark.click();
        check(deliver(3), "a frame later");
        check(status().equals("A note"), "a touched mark tells its words");
        click(R.id.sound);
        check(film().volume == 1, "sound");
        click(R.id.pause);
        check(!film().isPlaying(), "the visitor's pause");
        click(R.id.pause);
        check(film().isPlaying(), "continuing");
        Thread.sleep(300);
        check(deliver(4), "a frame later");
        check(status().equals("A note"), "a label's words");
        // Held for a frame or two, then a second of grace.
        for (int i = 0; i < 4; i++) check(deliver(clip.length / size / 2 + i), "a frame without the cover");
        check(film().isPlaying(), "grace");
        Thread.sleep(1200);
        check(deliver(clip.length / size / 2 + 4), "a frame more");
        check(!film().isPlaying(), "a film that waits");
        Handler.pump();
        check(mark.visibility == android.view.View.GONE, "no mark without its picture");
        check(android.app.AlertDialog.shown.asks.contains("https://museum.org/cover") && Context.started == null,
                "a question");
        android.app.AlertDialog.shown.yes.onClick(null, 0);
        check(Context.started.action.equals("android.intent.action.VIEW")
                        && Context.started.data.path.equals("https://museum.org/cover"),
                "the link");
        app.onPause();
        app.onDestroy();
    }

    private static File[] videoFiles(String folder) {
        File[] all = new File(Context.folder, folder).listFiles((in, name) -> name.startsWith("video-"));
        return all == null ? new File[0] : all;
    }

    /** Packets of a track of what the encoder's file has. */
    private static java.util.List<Object[]> packets(int track) {
        java.util.List<Object[]> found = new java.util.ArrayList<>();
        for (Object[] each : android.media.MediaMuxer.packets) {
            if ((Integer) each[0] == track) found.add(each);
        }
        return found;
    }

    /** The share of a recorded picture that is not what the screen shows at the same place. */
    private static double unlike(byte[] recorded, byte[] screen, int width, int height) {
        int far = 0;
        for (int y = 0; y < height; y++) {
            for (int x = 0; x < width; x++) {
                int to = 4 * (y * width + x),
                    from = 4 * (y * Camera.height / height * Camera.width + x * Camera.width / width);
                int off = 0;
                for (int k = 0; k < 3; k++)
                    off = Math.max(off, Math.abs((recorded[to + k] & 255) - (screen[from + k] & 255)));
                if (off > 60) far++;
            }
        }
        return (double) far / (width * height);
    }

    /** What a stopped recording left: a whole file in the gallery, and nothing else anywhere. */
    private static void whole(String folder, int count) throws Exception {
        joinAll("modar-video");
        check(status().equals("Saved to your videos"), "saved");
        check(((TextView) app.findViewById(R.id.record)).text.equals("Video"), "ready for another");
        File[] saved = videoFiles(folder);
        check(saved.length == count, saved.length + " videos");
        java.util.Arrays.sort(saved);
        check(new String(Files.readAllBytes(saved[count - 1].toPath())).endsWith("whole\n"), "a whole file");
        check(android.media.MediaCodec.open == 0 && android.opengl.EGL14.open == 0
                        && android.media.MediaExtractor.open == 0,
                "all is given back");
        for (String each : Context.folder.list())
            check(!each.startsWith("video") && !each.startsWith("media1"), "left: " + each);
    }

    /** Recorded are the screen's pictures and the film's sound, at their times; the file is whole however it ends. */
    private static void videos() throws Exception {
        start();
        for (int i = 0; i < 4; i++) check(deliver(i), "frame " + i);
        click(R.id.sound);
        click(R.id.record);
        byte[][] shown = new byte[8][];
        for (int i = 0; i < shown.length; i++) {
            android.os.SystemClock.ahead += 100000000L;
            android.media.MediaPlayer.pass(100);
            check(deliver(i), "frame " + i);
            shown[i] = picture();
        }
        Handler.pump();
        check(((TextView) app.findViewById(R.id.record)).text.equals("Stop"), "a button to stop");
        click(R.id.record);
        view.frame();
        whole("Movies/ModAR", 1);
        check(android.media.MediaMuxer.tracks.equals(java.util.Arrays.asList("video/avc", "audio/mp4a-latm")),
                "pictures and sound");
        java.util.List<Object[]> pictures = packets(0), sounds = packets(1);
        check(pictures.size() >= shown.length, pictures.size() + " pictures of " + shown.length);
        int width = (Camera.width + 8) / 16 * 16, height = ((byte[]) pictures.get(0)[2]).length / 4 / width;
        check(Math.abs(height - Camera.height) <= 8 && height % 16 == 0, "its size: " + width + " x " + height);
        long time = -1;
        for (int i = 0; i < shown.length; i++) {
            Object[] each = pictures.get(pictures.size() - shown.length + i);
            check((Long) each[1] > time, "times rise");
            check(i == 0 || (Long) each[1] - time >= 100000 && (Long) each[1] - time < 2000000, "a picture each 0.1 s");
            time = (Long) each[1];
            double off = unlike((byte[]) each[2], shown[i], width, height);
            check(off < 0.03, "picture " + i + " is the screen's: " + off);
            check(i == 0 || unlike((byte[]) each[2], shown[i - 1], width, height) > off, "and not the one before");
        }
        // 800 ms of packets of 23 ms, one after the other, from where the film was.
        int first = ByteBuffer.wrap((byte[]) sounds.get(0)[2]).getInt();
        check(sounds.size() > 10 && first < 10, sounds.size() + " packets from " + first);
        for (int i = 1; i < sounds.size(); i++)
            check((Long) sounds.get(i)[1] > (Long) sounds.get(i - 1)[1], "sounds rise");
        click(R.id.share);
        check(Context.started.of.type.equals("video/mp4")
                        && ((android.net.Uri) Context.started.of.stream).path.contains("/video-"),
                "shared");
        // Without sound, by Android 10, until it is long enough.
        android.os.Build.VERSION.SDK_INT = 29;
        click(R.id.sound);
        click(R.id.record);
        check(deliver(0), "a frame");
        android.os.SystemClock.ahead += 31000000000L;
        check(deliver(1), "half a minute later");
        whole("gallery", 1);
        check(android.media.MediaMuxer.tracks.size() == 1, "silent");
        // A call.
        click(R.id.record);
        check(deliver(0) && deliver(1), "frames");
        app.onPause();
        app.onResume();
        check(deliver(0), "continues");
        whole("gallery", 2);
        // The context goes with all that is in it.
        click(R.id.record);
        check(deliver(0) && deliver(1), "frames");
        view.surface(Camera.width, Camera.height, true);
        android.opengl.EGL14.open = 0;
        check(deliver(0), "continues");
        whole("gallery", 3);
        android.media.MediaCodec.busy = true;
        click(R.id.record);
        check(deliver(0), "continues");
        check(status().equals("No video: no encoder is free") && android.media.MediaCodec.open == 0,
                "no encoder: " + status());
        app.onPause();
        app.onDestroy();
    }

    private static android.view.View shown(int id) {
        android.view.View view = app.findViewById(id);
        check(view.getVisibility() == android.view.View.VISIBLE, "there: " + id);
        return view;
    }

    private static boolean gone(int id) {
        return app.findViewById(id).getVisibility() == android.view.View.GONE;
    }

    private static android.view.View corners() {
        return ((android.view.ViewGroup) app.findViewById(R.id.own_photo)).children.get(0);
    }

    /** What the corners' view draws. */
    private static android.graphics.Canvas drawn() {
        android.graphics.Canvas canvas = new android.graphics.Canvas();
        corners().draw(canvas);
        check(canvas.lines == 4 && canvas.circles.size() == 4, "four corners");
        return canvas;
    }

    /** Where the print is in the first frame of the test's clip, pixels. */
    private static final int PRINT_LEFT = 135, PRINT_TOP = 30, PRINT_RIGHT = 345, PRINT_BOTTOM = 330;

    /**
     * The clip shows a picture that the bundle does not know: photographed, its corners repaired,
     * it has the chosen model; on later visits, too, until it is forgotten. other: a file of a
     * picture.
     */
    private static void own(String other) throws Exception {
        start();
        check(!gone(R.id.menu), "the app opens with the menu");
        click(R.id.menu_go);
        check(gone(R.id.menu), "go");
        byte[] alone = shown();
        android.window.OnBackInvokedDispatcher.last.onBackInvoked(); // as Android 16 does
        check(!gone(R.id.menu) && !Activity.left, "back to the menu");
        check(((TextView) shown(R.id.menu_model)).text.equals("Model: pottery") && gone(R.id.menu_forget),
                "the first model");
        click(R.id.menu_model);
        check(((TextView) shown(R.id.menu_model)).text.startsWith("Model: bust"), "the other model");
        click(R.id.menu_take);
        check(status().startsWith("Photograph something flat")
                        && ((TextView) shown(R.id.picture)).text.equals("Photograph"),
                "how");
        app.onBackPressed();
        check(!gone(R.id.menu) && ((TextView) app.findViewById(R.id.picture)).text.equals("Picture"), "not now");
        click(R.id.menu_take);
        check(deliver(0), "a frame");
        click(R.id.picture);
        view.frame();
        Handler.pump();
        shown(R.id.own);
        android.view.View corners = corners();
        check(drawn().bitmap.getWidth() == Camera.width && corners.described.equals("Corner 1"), corners.described);
        // The photo is as large as its view. Found were the print's corners, which are on the
        // screen as the sensor does.
        float[][] found = drawn().circles.toArray(new float[0][]);
        double scale = (double) Camera.width / Camera.height;
        double[][] print = {{PRINT_TOP, PRINT_RIGHT}, {PRINT_BOTTOM, PRINT_RIGHT}, {PRINT_BOTTOM, PRINT_LEFT},
                {PRINT_TOP, PRINT_LEFT}};
        for (int i = 0; i < 4; i++) {
            // Turned clockwise: the upper side is on the right. Clockwise from the top left.
            double x = Camera.width - scale * print[(i + 2) % 4][0],
                   y = Camera.height / 2.0 + scale * (print[(i + 2) % 4][1] - Camera.width / 2.0);
            check(Math.hypot(found[i][0] - x, found[i][1] - y) < 8,
                    "corner " + i + ": " + found[i][0] + " " + found[i][1] + " is not " + x + " " + y);
        }
        corners.onTouchEvent(new MotionEvent(MotionEvent.ACTION_DOWN, found[0][0], found[0][1]));
        corners.onTouchEvent(new MotionEvent(MotionEvent.ACTION_MOVE, found[0][0] + 20, found[0][1] + 3));
        check(drawn().circles.get(0)[0] == found[0][0] + 20 && drawn().circles.get(0)[1] == found[0][1] + 3,
                "a dragged corner");
        for (int i = 0; i < 4; i++) corners.performClick();
        check(corners.described.equals("Corner 1"), "once around");
        android.view.KeyEvent key = new android.view.KeyEvent();
        for (int i = 0; i < 10; i++) corners.onKeyDown(android.view.KeyEvent.KEYCODE_DPAD_LEFT, key);
        corners.onKeyDown(android.view.KeyEvent.KEYCODE_DPAD_UP, key);
        check(Math.hypot(drawn().circles.get(0)[0] - found[0][0], drawn().circles.get(0)[1] - found[0][1]) < 2,
                "keys return it");
        click(R.id.own_use);
        joinAll("modar-own");
        Handler.pump();
        check(gone(R.id.own) && new File(Context.folder, "own").list().length == 1, "kept: " + status());
        check(Camera.opened == 1, "the camera continues");
        byte[] standing = shown();
        check(changed(alone, standing) > 0.02, "the model is on it: " + changed(alone, standing));
        Handler.pump();
        check(view.described.contains("Your picture"), view.described);
        app.onPause();
        app.onDestroy();
        start();
        click(R.id.menu_go);
        check(changed(alone, shown()) > 0.02, "on the next visit, too");
        // A wall, through another app.
        app.onBackPressed();
        click(R.id.menu_choose);
        check(Activity.wanted.type.equals("image/*"), "asks another app");
        android.content.Intent answer = new android.content.Intent("", new android.net.Uri(other));
        app.onActivityResult(2, Activity.RESULT_OK, answer);
        check(drawn().bitmap.getWidth() == 1024, "as large as it has to be: " + drawn().bitmap.getWidth());
        check(Math.abs(drawn().circles.get(0)[0] - 0.1 * Camera.width) < 1
                        && Math.abs(drawn().circles.get(2)[1] - 0.9 * Camera.height) < 1,
                "corners at its margins");
        click(R.id.own_use);
        joinAll("modar-own");
        check(status().startsWith("There is too little in this picture"), "too plain");
        shown(R.id.own);
        app.onBackPressed();
        check(gone(R.id.own) && !gone(R.id.menu), "back");
        for (int i = 1; i <= 8; i++) upright(other.replace("wall.png", "turned" + i + ".jpg"));
        app.onActivityResult(
                2, Activity.RESULT_OK, new android.content.Intent("", new android.net.Uri(other + ".none")));
        check(status().startsWith("This file is no picture"), "no file");
        lists();
        shown(R.id.menu_forget).click();
        check(new File(Context.folder, "own").list().length == 0 && gone(R.id.menu_forget), "forgotten");
        check(changed(alone, shown()) < 0.001, "no model is there: " + changed(alone, shown()));
        app.onBackPressed();
        check(Activity.left, "from the menu out");
        app.onPause();
        app.onDestroy();
    }

    private static void fingers() {
        deliver(0);
        view.requestRender();
        view.frame();
        byte[] before = picture();
        view.touch(new MotionEvent(MotionEvent.ACTION_DOWN, 100, 100));
        view.touch(new MotionEvent(MotionEvent.ACTION_POINTER_DOWN, 100, 100, 200, 100));
        view.touch(new MotionEvent(MotionEvent.ACTION_MOVE, 100, 100, 200, 100));
        view.touch(new MotionEvent(MotionEvent.ACTION_MOVE, 50, 100, 250, 100));
        view.touch(new MotionEvent(MotionEvent.ACTION_POINTER_UP, 50, 100, 250, 100));
        view.touch(new MotionEvent(MotionEvent.ACTION_UP, 50, 100));
        view.requestRender();
        view.frame();
        check(changed(before, picture()) > 0.01, "a pinch changes the picture");
        android.os.Build.VERSION.SDK_INT = 19;
    }

    /** A call, a sleeping phone whose context is lost, a turned screen. */
    private static void pauses() throws Exception {
        app.onPause();
        check(Camera.opened == 0, "the camera is free for the call");
        check(new File(Context.folder, "diagnostics.txt").length() > 0, "diagnostics");
        check(!deliver(0), "no frame in a pause");
        Camera.busy = true;
        app.onResume();
        check(status().startsWith("The camera is not responding"), "another app has it");
        app.onPause();
        Camera.busy = false;
        app.onResume();
        check(GLSurfaceView.samples == 4, "smooth edges");
        GLSurfaceView.most = 0;
        view.surface(Camera.width, Camera.height, true); // the context was lost meanwhile
        check(GLSurfaceView.samples == 0, "a surface of one sample");
        check(Camera.opened == 1 && deliver(0) && deliver(1), "continues");
        // The new session's first frames tell how the camera sees, and the model's picture follows.
        for (int i = 0; i < 20; i++) check(deliver(1), "settles");
        byte[] upright = picture();
        Activity.rotation = 1;
        app.onConfigurationChanged(null);
        view.surface(Camera.width, Camera.height, false);
        check(deliver(1), "turned");
        check(changed(upright, picture()) > 0.25, "a turned phone turns the picture");
        Activity.rotation = 0;
        app.onConfigurationChanged(null);
        check(deliver(1) && changed(upright, picture()) < 0.01, "turned back");
    }

    /** The share of a picture in the gray that is behind models without a camera: 0.85 of 255. */
    private static double ground(byte[] picture) {
        int gray = 0;
        for (int i = 0; i < picture.length; i += 4) {
            if (Math.abs((picture[i] & 0xFF) - 217) + Math.abs((picture[i + 1] & 0xFF) - 217) < 3) gray++;
        }
        return 4.0 * gray / picture.length;
    }

    private static void drag(float x, float y) {
        view.touch(new MotionEvent(MotionEvent.ACTION_DOWN, 240, 180));
        view.touch(new MotionEvent(MotionEvent.ACTION_MOVE, 240 + x, 180 + y));
        view.touch(new MotionEvent(MotionEvent.ACTION_UP, 240 + x, 180 + y));
        view.frame();
    }

    /** Refused, the models can be looked at all the same. */
    private static void withoutPermission() {
        Activity.allowed = false;
        click(R.id.around);
        view.frame();
        check(Camera.opened == 0 && ground(picture()) > 0.2 && ground(picture()) < 0.95, "without the camera");
        Activity.allowed = true;
        click(R.id.around);
        check(Camera.opened == 1, "the camera again");
    }

    /** A look without the camera: the model alone, turned by fingers, told by a tap; and back. The picture goes to a file. */
    private static void around(String out) throws Exception {
        check(deliver(0) && deliver(1), "the camera");
        check(view.described.equals("Eine Vase \uD83C\uDFFA") || view.described.equals("A vase \uD83C\uDFFA"),
                view.described);
        click(R.id.around);
        check(Camera.opened == 0, "the camera is off");
        view.frame();
        byte[] front = picture();
        Files.write(Paths.get(out + ".around"), front);
        check(ground(front) > 0.2 && ground(front) < 0.95, "a model before gray: " + ground(front));
        check(status().equals("Found in 1922."), "its text");
        drag(120, 0);
        byte[] turned = picture();
        check(changed(front, turned) > 0.01, "turned: " + changed(front, turned));
        drag(0, 60);
        check(changed(turned, picture()) > 0.01, "from above");
        view.touch(new MotionEvent(MotionEvent.ACTION_DOWN, 240, 180));
        view.touch(new MotionEvent(MotionEvent.ACTION_UP, 240, 180));
        check(status().equals("pottery"), "a tap tells the model: " + status());
        app.onPause();
        app.onResume();
        check(Camera.opened == 0, "a pause does not start the camera");
        view.frame();
        check(ground(picture()) > 0.2, "still without it");
        click(R.id.around);
        check(Camera.opened == 1 && deliver(0) && deliver(1), "the camera again");
        check(ground(picture()) < 0.2, "its picture");
    }

    /** In the background the phone wants memory back; later the same picture is there. */
    private static void memory() throws Exception {
        for (int i = 0; i < 20; i++) check(deliver(1), "settles");
        byte[] before = picture();
        app.onTrimMemory(40);
        check(((android.view.ViewGroup) app.findViewById(R.id.screen)).gone == 0, "nothing goes while it is in use");
        app.onPause();
        app.onTrimMemory(20);
        check(((android.view.ViewGroup) app.findViewById(R.id.screen)).gone == 0, "hidden only");
        app.onTrimMemory(40);
        app.onTrimMemory(80);
        check(((android.view.ViewGroup) app.findViewById(R.id.screen)).gone == 1, "GL's memory is given back, once");
        app.onResume();
        view.surface(Camera.width, Camera.height, true);
        for (int i = 0; i < 20; i++) check(deliver(1), "continues");
        check(changed(before, picture()) < 0.01, "the same picture: " + changed(before, picture()));
    }

    /** Another language of the phone: the screen's words and the bundle's texts. */
    private static void german() throws Exception {
        Files.write(new File(Context.folder, "focal").toPath(), "torn".getBytes());
        java.util.Locale.setDefault(new java.util.Locale("de", "CH"));
        start();
        check(status().startsWith("Richten Sie die Kamera auf: cover"), status());
        check(((TextView) app.findViewById(R.id.around)).text.equals("Ohne Kamera"), "buttons");
        check(view.described.startsWith("Das Kamerabild"), view.described);
        for (int i = 0; i < 10; i++) check(deliver(i), "frame " + i);
        Handler.pump();
        check(view.described.equals("Eine Vase \uD83C\uDFFA"), view.described);
        app.onPause();
        app.onDestroy();
        java.util.Locale.setDefault(java.util.Locale.ENGLISH);
    }

    private static File[] pictureFiles(String folder) {
        File[] all = new File(Context.folder, folder).listFiles((in, name) -> name.startsWith("picture-"));
        return all == null ? new File[0] : all;
    }

    /** What Bitmap.compress() of the fake wrote, 0xAARRGGBB from the top, as picture() is. */
    private static byte[] shownPixels(byte[] file) {
        byte[] rgba = new byte[file.length];
        int row = 4 * Camera.width;
        for (int i = 0; i < file.length; i += 4) {
            int to = (file.length / row - 1 - i / row) * row + i % row;
            for (int k = 0; k < 4; k++) rgba[to + k] = file[i + (k + 1) % 4];
        }
        return rgba;
    }

    private static void savedPicture() throws Exception {
        click(R.id.picture);
        view.frame();
        for (Thread thread : Thread.getAllStackTraces().keySet()) {
            if (thread.getName().equals("modar-picture")) thread.join();
        }
    }

    /** By each version of Android: saved with what the screen shows, and shared; on a full storage it says so and leaves nothing. */
    private static void pictures() throws Exception {
        int[] versions = {19, 21, 29};
        String[] folders = {"Pictures/ModAR", "media", "gallery"};
        for (int i = 0; i < versions.length; i++) {
            android.os.Build.VERSION.SDK_INT = versions[i];
            savedPicture();
            Handler.pump();
            File[] saved = pictureFiles(folders[i]);
            check(saved.length == 1 && status().equals("Saved to your pictures"),
                    "saved " + folders[i] + ": " + status());
            check(changed(shownPixels(Files.readAllBytes(saved[0].toPath())), picture()) == 0,
                    "the screen's own picture");
            click(R.id.share);
            android.content.Intent send = Context.started.of;
            check(send.action.equals(android.content.Intent.ACTION_SEND) && send.type.equals("image/jpeg")
                            && send.flags == 1,
                    "shared");
            check(((android.net.Uri) send.stream).path.replace("pending-", "").equals(saved[0].getPath()),
                    "the newest");
            Bitmap.full = true;
            savedPicture();
            Handler.pump();
            check(status().startsWith("The picture was not saved"), "full: " + status());
            check(new File(Context.folder, folders[i]).list().length == 1, "nothing half-written");
            Bitmap.full = false;
        }
        android.os.Build.VERSION.SDK_INT = 19;
        app.onPause();
        app.onDestroy();
    }

    /** A damaged file of the same name in the folder: the APK's own replaces it; with that one damaged, too, it says why. */
    private static void damage() throws Exception {
        Path pushed = new File(Context.folder, "vase.modar").toPath();
        Files.write(pushed, new byte[5000]);
        start();
        check(Camera.opened == 1 && deliver(0), "the APK's bundle");
        app.onPause();
        app.onDestroy();
        AssetManager.apk = AssetManager.apk + ".empty";
        start();
        check(status().startsWith("The models cannot be read: bundle.magic"), "damaged");
        check(Camera.opened == 0, "no camera for nothing");
        app.onPause();
        app.onDestroy();
        Files.delete(pushed);
        start();
        check(status().startsWith("There is nothing to show"), "empty");
        app.onPause();
        app.onDestroy();
    }

    /** A bundle that opens, with one byte wrong in the drawing: found in the background, once; then another is shown. */
    private static void rot() throws Exception {
        start();
        joinAll("modar-verify");
        check(deliver(0), "the APK's bundle");
        app.onPause();
        app.onDestroy();
        start();
        for (Thread thread : Thread.getAllStackTraces().keySet()) {
            check(!thread.getName().equals("modar-verify"), "it is not verified twice");
        }
        byte[] bundle;
        try (java.util.zip.ZipFile apk = new java.util.zip.ZipFile(AssetManager.apk)) {
            bundle = apk.getInputStream(apk.getEntry("assets/bundles/vase.modar")).readAllBytes();
        }
        app.onPause();
        app.onDestroy();
        bundle[bundle.length - 1] ^= 1;
        Path pushed = new File(Context.folder, "vase.modar").toPath();
        Files.write(pushed, bundle);
        start();
        joinAll("modar-verify");
        check(!status().startsWith("The models cannot be read"), "the APK's own replaces it");
        check(Camera.opened == 1 && deliver(0), "continues with the APK's bundle");
        app.onPause();
        String told = new String(Files.readAllBytes(new File(Context.folder, "diagnostics.txt").toPath()));
        check(told.contains("bundle: vase (app)") && told.contains("section.hash"), "which one was wrong: " + told);
        app.onDestroy();
        Files.delete(pushed);
    }

    /** A release from a stick while the app runs; then its file rots: the APK's bundle replaces it. */
    private static void update() throws Exception {
        start();
        deliver(0);
        check(installed().length == 0, "no release yet");
        click(R.id.update);
        for (Thread thread : Thread.getAllStackTraces().keySet()) {
            if (thread.getName().equals("modar-update")) thread.join();
        }
        check(status().equals("Updated"), "updated");
        check(installed().length == 1, "installed");
        check(deliver(0) && deliver(1), "continues with the release");
        app.onPause();
        check(new String(Files.readAllBytes(new File(Context.folder, "diagnostics.txt").toPath()))
                        .contains("vase (release)"),
                "the bundle of the release");
        app.onDestroy();
        Files.write(Paths.get(installed()[0]), new byte[64]);
        start();
        check(Camera.opened == 1 && deliver(0), "the APK's bundle after a rotten release");
        app.onPause();
        app.onDestroy();
    }

    private static void joinAll(String name) throws Exception {
        for (Thread thread : Thread.getAllStackTraces().keySet()) {
            if (thread.getName().equals(name)) thread.join();
        }
    }

    private static String updated() throws Exception {
        click(R.id.update);
        joinAll("modar-update");
        return status();
    }

    /**
     * Releases from a web server while the app runs. The server is the test's: it continues to the
     * next step when a file of that name appears in `folder`, and answers by NAME.done.
     */
    private static void network(Path folder) throws Exception {
        start();
        check(deliver(0) && deliver(1), "the APK's bundle");
        if (Files.exists(folder.resolve("full"))) {
            check(updated().startsWith("No update: ") && status().contains("No space left"), "a full storage");
            check(installed().length == 0 && deliver(0) && deliver(1), "continues with the APK's bundle");
            step(folder, "freed");
        }
        check(updated().equals("Updated") && installed().length == 1, "the first release");
        check(deliver(0) && deliver(1), "continues with the first release");
        check(updated().equals("The newest release is already installed"), "nothing new");
        step(folder, "second");
        check(updated().equals("Updated"), "the second release");
        check(deliver(0) && deliver(1), "continues with the second release");
        String before = Fetch.version(new File(Context.folder, "store").getPath());
        check(before.equals("2"), "the second release is in use");
        for (String trouble : new String[] {"forged", "gone"}) {
            step(folder, trouble);
            check(updated().startsWith("No update: "), trouble);
            check(Fetch.version(new File(Context.folder, "store").getPath()).equals(before),
                    trouble + ": the release stays");
            check(deliver(0) && deliver(1), trouble + ": the app continues");
        }
        app.onPause();
        app.onDestroy();
    }

    /** The app has no bundle, and the server keeps the last stage back until it is requested `rest`. */
    private static void first(Path folder) throws Exception {
        start();
        check(status().startsWith("There is nothing to show"), "nothing yet");
        click(R.id.update);
        for (int i = 0; i < 600 && Camera.opened == 0; i++) {
            Handler.pump();
            Thread.sleep(50);
        }
        check(new File(Context.folder, "store/pieces/urn.first").exists() && installed().length == 0,
                "the preview alone");
        check(deliver(0) && deliver(1) && told().contains("urn (preview)"), "shows the preview");
        View more = app.findViewById(R.id.models);
        for (int i = 0; i < 600 && more.getVisibility() != View.VISIBLE; i++) {
            Handler.pump();
            Thread.sleep(50);
        }
        click(R.id.models);
        check(deliver(0) && deliver(1) && told().contains("vase (preview)"), "shows the other bundle's");
        step(folder, "rest");
        joinAll("modar-update");
        check(status().equals("Updated") && installed().length == 2, "installed");
        check(deliver(0) && deliver(1) && told().contains("urn (release)"), "continues with the release");
        app.onDestroy();
    }

    /** What diagnostics.txt says, after a pause. */
    private static String told() throws Exception {
        app.onPause();
        app.onResume();
        view.surface(Camera.width, Camera.height, true);
        return new String(Files.readAllBytes(new File(Context.folder, "diagnostics.txt").toPath()));
    }

    private static void step(Path folder, String name) throws Exception {
        Files.write(folder.resolve(name), new byte[0]);
        for (int i = 0; i < 600 && !Files.exists(folder.resolve(name + ".done")); i++) Thread.sleep(50);
        check(Files.exists(folder.resolve(name + ".done")), "the server's step " + name);
    }

    private static String[] installed() {
        return Fetch.installed(new File(Context.folder, "store").getPath());
    }
}

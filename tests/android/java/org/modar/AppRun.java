package org.modar;

import android.app.Activity;
import android.content.Context;
import android.content.res.AssetManager;
import android.graphics.Bitmap;
import android.hardware.Camera;
import android.opengl.GLSurfaceView;
import android.os.Handler;
import android.view.MotionEvent;
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

    /** words: APK, clip, width, height, the app's folder, where to put the last picture. */
    public static void main(String[] words) throws Exception {
        AssetManager.apk = words[0];
        clip = Files.readAllBytes(Paths.get(words[1]));
        Camera.width = Integer.parseInt(words[2]);
        Camera.height = Integer.parseInt(words[3]);
        size = Camera.width * Camera.height * 3 / 2;
        Context.folder = new File(words[4]);
        Stage.searchApart = false;

        permission();
        frames(words[5]);
        fingers();
        pauses();
        pictures();
        damage();
        AssetManager.apk = words[0];
        update();
        System.out.println("the day is over");
    }

    private static void check(boolean good, String what) {
        if (!good) throw new AssertionError(what + "; the screen says: " + status());
    }

    /** The line of advice is the first label that the activity makes. */
    private static String status() {
        Handler.pump();
        return TextView.ALL.get(0).text;
    }

    private static TextView labelled(String text) {
        for (TextView each : TextView.ALL) {
            if (each.text.equals(text)) return each;
        }
        throw new AssertionError("no button " + text);
    }

    private static void start() throws Exception {
        TextView.ALL.clear();
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
        boolean taken = Camera.current.deliver(frame);
        view.frame();
        return taken;
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
            app.onClick(null); // nothing was clicked
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

    private static void fingers() {
        deliver(0);
        view.requestRender();
        view.frame();
        byte[] before = picture();
        view.touch(new MotionEvent(MotionEvent.ACTION_DOWN, 100, 100));
        view.touch(new MotionEvent(MotionEvent.ACTION_POINTER_DOWN, 100, 100, 200, 100));
        view.touch(new MotionEvent(MotionEvent.ACTION_MOVE, 100, 100, 200, 100));
        view.touch(new MotionEvent(MotionEvent.ACTION_MOVE, 50, 100, 250, 100));
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
        check(status().startsWith("The camera does not answer"), "another app has it");
        app.onPause();
        Camera.busy = false;
        app.onResume();
        view.surface(Camera.width, Camera.height, true); // the context was lost meanwhile
        check(Camera.opened == 1 && deliver(0) && deliver(1), "goes on");
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

    private static long pictureFiles() throws Exception {
        try (java.util.stream.Stream<Path> all = Files.list(Context.folder.toPath())) {
            return all.filter(file -> file.getFileName().toString().startsWith("picture-")).count();
        }
    }

    private static void savedPicture() throws Exception {
        labelled("Picture").click();
        view.frame();
        for (Thread thread : Thread.getAllStackTraces().keySet()) {
            if (thread.getName().equals("modar-picture")) thread.join();
        }
    }

    /** Saved; on a full storage it says so and leaves nothing. */
    private static void pictures() throws Exception {
        savedPicture();
        check(pictureFiles() == 1, "saved");
        Bitmap.full = true;
        savedPicture();
        check(status().startsWith("The picture was not saved"), "full");
        check(pictureFiles() == 1, "nothing half-written");
        app.onPause();
        app.onDestroy();
    }

    /** A damaged file of the same name in the folder: the APK's own stands in; with that one damaged, too, it says why. */
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

    /** A release from a stick while the app runs; then its file rots: the APK's bundle stands in. */
    private static void update() throws Exception {
        start();
        deliver(0);
        check(installed().length == 0, "no release yet");
        labelled("Update").click();
        for (Thread thread : Thread.getAllStackTraces().keySet()) {
            if (thread.getName().equals("modar-update")) thread.join();
        }
        check(status().equals("Updated"), "updated");
        check(installed().length == 1, "installed");
        check(deliver(0) && deliver(1), "goes on with the release");
        app.onPause();
        check(new String(Files.readAllBytes(new File(Context.folder, "diagnostics.txt").toPath())).contains("vase (release)"),
                "the bundle of the release");
        app.onDestroy();
        Files.write(Paths.get(installed()[0]), new byte[64]);
        start();
        check(Camera.opened == 1 && deliver(0), "the APK's bundle after a rotten release");
        app.onPause();
        app.onDestroy();
    }

    private static String[] installed() {
        return Fetch.AVAILABLE ? Fetch.installed(new File(Context.folder, "store").getPath()) : new String[0];
    }
}

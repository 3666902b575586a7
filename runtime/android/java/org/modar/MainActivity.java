package org.modar;

import android.Manifest;
import android.app.Activity;
import android.content.pm.PackageManager;
import android.content.res.Configuration;
import android.graphics.Bitmap;
import android.graphics.Color;
import android.opengl.GLSurfaceView;
import android.os.Build;
import android.os.Bundle;
import android.os.Handler;
import android.os.Looper;
import android.view.Display;
import android.view.Gravity;
import android.view.MotionEvent;
import android.view.View;
import android.view.ViewGroup;
import android.view.WindowManager;
import android.widget.Button;
import android.widget.FrameLayout;
import android.widget.ImageView;
import android.widget.LinearLayout;
import android.widget.ScrollView;
import android.widget.TextView;
import java.io.File;
import java.io.FileOutputStream;
import java.io.IOException;
import java.nio.ByteBuffer;
import java.util.List;
import java.util.Properties;

/** The one screen: the camera's picture with models on it, a line of advice, four buttons. */
public final class MainActivity extends Activity
        implements Stage.Listener, Fingers.Listener, View.OnTouchListener, View.OnClickListener {
    /** How often the line of advice follows what the tracker says. */
    private static final int TICK_MS = 500;
    private static final int ASKED_FOR_CAMERA = 1;

    private final Handler main = new Handler(Looper.getMainLooper());
    private final Diagnostics diagnostics = new Diagnostics();
    private final Fingers fingers = new Fingers(this);
    private Words words;
    private Bundles bundles;
    private Stage stage;
    private CameraFeed feed;
    private CameraFeed stopped;
    private boolean resumed;
    private boolean asked;

    // What is shown:
    private List<Bundles.Source> sources;
    private int source = -1;
    private long session;
    private String[] patterns = {};
    private Properties texts = new Properties();
    /** An error stays on the screen until something works again; null: advice. */
    private String trouble;
    private long noticeUntil;

    private GLSurfaceView view;
    private TextView status;
    private ImageView hint;
    private Button picture;
    private Button models;
    private Button update;
    private Button about;
    private ScrollView info;
    private TextView infoText;

    private final Runnable tick = new Runnable() {
        @Override
        public void run() {
            follow();
            main.postDelayed(this, TICK_MS);
        }
    };

    @Override
    protected void onCreate(Bundle state) {
        super.onCreate(state);
        words = new Words(getAssets());
        bundles = new Bundles(this);
        buildScreen();
        stage = new Stage(view, this, diagnostics);
        view.setEGLContextClientVersion(2);
        view.setEGLConfigChooser(8, 8, 8, 0, 16, 0);
        view.setPreserveEGLContextOnPause(true);
        view.setRenderer(stage);
        view.setRenderMode(GLSurfaceView.RENDERMODE_WHEN_DIRTY);
        sources = bundles.list();
        showNext();
    }

    private void buildScreen() {
        view = new GLSurfaceView(this);
        view.setKeepScreenOn(true);
        view.setOnTouchListener(this);
        hint = new ImageView(this);
        hint.setAlpha(0.6f);
        status = label(18);
        LinearLayout buttons = new LinearLayout(this);
        picture = button(buttons, "picture");
        models = button(buttons, "models");
        update = button(buttons, "update");
        about = button(buttons, "about");
        infoText = label(14);
        info = new ScrollView(this);
        info.setBackgroundColor(Color.BLACK);
        info.setVisibility(View.GONE);
        info.addView(infoText);
        int wrap = ViewGroup.LayoutParams.WRAP_CONTENT;
        int match = ViewGroup.LayoutParams.MATCH_PARENT;
        FrameLayout root = new FrameLayout(this);
        root.addView(view, new FrameLayout.LayoutParams(match, match, Gravity.CENTER));
        root.addView(hint, new FrameLayout.LayoutParams(wrap, wrap, Gravity.CENTER));
        root.addView(info, new FrameLayout.LayoutParams(match, match, Gravity.CENTER));
        root.addView(status, new FrameLayout.LayoutParams(match, wrap, Gravity.BOTTOM));
        root.addView(buttons, new FrameLayout.LayoutParams(match, wrap, Gravity.TOP));
        setContentView(root);
        update.setVisibility(Fetch.AVAILABLE ? View.VISIBLE : View.GONE);
    }

    private TextView label(int size) {
        TextView text = new TextView(this);
        text.setTextColor(Color.WHITE);
        text.setTextSize(size);
        text.setPadding(16, 16, 16, 16);
        text.setBackgroundColor(0xA0000000);
        return text;
    }

    private Button button(LinearLayout row, String word) {
        Button made = new Button(this);
        made.setText(words.get(word));
        made.setOnClickListener(this);
        row.addView(made);
        return made;
    }

    // --- Life ---

    @Override
    protected void onResume() {
        super.onResume();
        resumed = true;
        view.onResume();
        if (!mayUseCamera()) {
            if (!asked) askForCamera();
        } else {
            startCamera();
        }
        main.post(tick);
    }

    @Override
    protected void onPause() {
        resumed = false;
        main.removeCallbacks(tick);
        stopCamera();
        view.onPause();
        closeCamera();
        writeDiagnostics();
        super.onPause();
    }

    @Override
    protected void onDestroy() {
        Native.close(session);
        session = 0;
        super.onDestroy();
    }

    @Override
    public void onConfigurationChanged(Configuration now) {
        super.onConfigurationChanged(now);
        followDisplay();
    }

    private void followDisplay() {
        Display display = getWindowManager().getDefaultDisplay();
        stage.setDisplayDegrees(90 * display.getRotation());
    }

    private boolean mayUseCamera() {
        return Build.VERSION.SDK_INT < 23
                || checkSelfPermission(Manifest.permission.CAMERA) == PackageManager.PERMISSION_GRANTED;
    }

    private void askForCamera() {
        asked = true;
        trouble = words.get("permission");
        if (Build.VERSION.SDK_INT >= 23) {
            requestPermissions(new String[] {Manifest.permission.CAMERA}, ASKED_FOR_CAMERA);
        }
    }

    @Override
    public void onRequestPermissionsResult(int request, String[] permissions, int[] answers) {
        if (request != ASKED_FOR_CAMERA || !mayUseCamera()) return;
        trouble = null;
        if (resumed) startCamera();
    }

    private void startCamera() {
        if (feed != null || session == 0) return;
        trouble = null;
        followDisplay();
        try {
            Native.reset(session);
        } catch (ModarException error) {
            failed(error);
        }
        feed = CameraFeed.create(this, stage, patterns.length);
        feed.start();
    }

    private void stopCamera() {
        if (feed == null) return;
        feed.stop();
        stopped = feed;
        feed = null;
    }

    /** Frames go back before the camera's memory does. */
    private void closeCamera() {
        stage.dropFrames();
        if (stopped != null) stopped.close();
        stopped = null;
    }

    // --- Bundles ---

    /** Opens the next bundle that can be opened, beginning after the one that is shown. */
    private void showNext() {
        stopCamera();
        ModarException damage = null;
        for (int i = 1; i <= sources.size(); i++) {
            int next = (source + i) % sources.size();
            try {
                use(next, bundles.open(sources.get(next)));
                if (damage == null) trouble = null;
                break;
            } catch (ModarException error) {
                damage = error;
                diagnostics.error(error.getMessage());
                if (sources.get(next).origin.equals("release") && goBack()) return;
            }
        }
        if (session == 0) {
            trouble = damage != null ? words.get("bundle", damage.getMessage()) : words.get("empty", bundles.folder);
        }
        closeCamera();
        models.setVisibility(sources.size() > 1 ? View.VISIBLE : View.GONE);
        if (resumed && mayUseCamera()) startCamera();
        follow();
    }

    /** The release in use is damaged: the one before it, if there is one. */
    private boolean goBack() {
        try {
            if (!Fetch.verify(bundles.store.getPath())) return false;
        } catch (ModarException gone) {
            diagnostics.error(gone.getMessage());
            return false;
        }
        sources = bundles.list();
        source = -1;
        showNext();
        return true;
    }

    private void use(int index, long opened) throws ModarException {
        source = index;
        Bundles.Source from = sources.get(index);
        patterns = new String[Native.patternCount(opened)];
        for (int i = 0; i < patterns.length; i++) patterns[i] = Native.patternName(opened, i);
        session = opened;
        texts = bundles.texts(from);
        hint.setImageBitmap(bundles.hint(from));
        diagnostics.bundle = from.name + " (" + from.origin + ")";
        diagnostics.release = Fetch.AVAILABLE ? Fetch.version(bundles.store.getPath()) : "none";
        stage.show(opened, bundles.lens());
        fingers.reset();
        if (!bundles.isVerified(from)) new Thread(new Check(from, opened), "modar-verify").start();
    }

    /** Reads every byte of a bundle once after it came, beside what the visitor does. */
    private final class Check implements Runnable {
        private final Bundles.Source from;
        private final long opened;
        private String damage;

        Check(Bundles.Source from, long opened) {
            this.from = from;
            this.opened = opened;
        }

        @Override
        public void run() {
            if (damage != null) { // on the main thread, the second time
                drop(from, damage);
                return;
            }
            try {
                Native.verify(opened);
                bundles.setVerified(from);
            } catch (ModarException damaged) {
                diagnostics.error(damaged.getMessage());
                if (damaged.code.equals("android.closed")) return; // another is shown by now
                damage = damaged.getMessage();
                main.post(this);
            } catch (IOException full) {
                diagnostics.error(full.getMessage());
            }
        }
    }

    /** A bundle that is shown turned out to be damaged: the next one, or the reason. */
    private void drop(Bundles.Source damaged, String cause) {
        if (source < 0 || sources.get(source) != damaged) return;
        sources.remove(source);
        source = -1;
        stopCamera();
        closeCamera();
        session = 0;
        stage.show(0, null);
        showNext();
        if (session == 0) trouble = words.get("bundle", cause);
        follow();
    }

    private void startUpdate() {
        String url = "";
        for (File place : getExternalFilesDirs(null)) {
            // A stick or card that brings a release, if there is one; else the network.
            if (place != null && new File(place, "release/releases").isDirectory()) {
                url = new File(place, "release").getPath();
            }
        }
        try {
            if (url.isEmpty()) url = bundles.asset("release.txt");
            update.setEnabled(false);
            new Thread(new Update(url, bundles.asset("release.pub")), "modar-update").start();
        } catch (IOException none) {
            notice(words.get("not-updated", "release.txt"));
        }
    }

    /** A thread that fetches; the app goes on with what it has. */
    private final class Update implements Runnable, Transfer.Progress {
        private final String url;
        private final String key;

        Update(String url, String key) {
            this.url = url;
            this.key = key;
        }

        @Override
        public void bytes(long done, long total) {
            say(words.get("fetching", done / 1000, total / 1000));
        }

        @Override
        public void run() {
            boolean changed = false;
            String text;
            try {
                changed = Fetch.fetch(url, bundles.store.getPath(), key, new Transfer(url, this));
                text = words.get(changed ? "updated" : "current");
            } catch (ModarException error) {
                diagnostics.error(error.getMessage());
                text = words.get("not-updated", error.getMessage());
            }
            say(text);
            final boolean installed = changed;
            main.post(new Runnable() {
                @Override
                public void run() {
                    update.setEnabled(true);
                    if (installed) showInstalled();
                }
            });
        }
    }

    private void showInstalled() {
        sources = bundles.list();
        source = -1;
        showNext();
    }

    // --- What the screen says ---

    /** The line at the bottom: trouble, a notice, what is seen, or what to do. */
    private void follow() {
        if (resumed) followDisplay();
        if (info.getVisibility() == View.VISIBLE) infoText.setText(diagnostics.text());
        if (System.nanoTime() < noticeUntil) return;
        boolean looking = false;
        String text = trouble;
        if (text == null) {
            int seen = stage.seen();
            looking = seen < 0;
            text = looking ? advice() : texts.getProperty(patterns[seen], "");
        }
        status.setText(text);
        status.setVisibility(text.isEmpty() ? View.GONE : View.VISIBLE);
        hint.setVisibility(looking ? View.VISIBLE : View.GONE);
    }

    /** What to look for, and what the tracker misses. */
    private String advice() {
        StringBuilder names = new StringBuilder();
        for (String pattern : patterns) {
            if (names.length() > 0) names.append(", ");
            names.append(texts.getProperty(pattern + ".name", pattern));
        }
        String look = words.get("look", names);
        if (diagnostics.frames() == 0) return look;
        try {
            return look + "\n" + words.advice(Native.reason(session));
        } catch (ModarException notYet) {
            return look;
        }
    }

    private void notice(String text) {
        noticeUntil = System.nanoTime() + 3000000000L;
        status.setText(text);
        status.setVisibility(View.VISIBLE);
    }

    /** From any thread. */
    private void say(final String text) {
        main.post(new Runnable() {
            @Override
            public void run() {
                notice(text);
            }
        });
    }

    private void complain(final String text) {
        diagnostics.error(text);
        main.post(new Runnable() {
            @Override
            public void run() {
                trouble = text;
                follow();
            }
        });
    }

    @Override
    public void failed(ModarException error) {
        complain(words.get(error.code.startsWith("gl.") ? "gl" : "bundle", error.getMessage()));
    }

    @Override
    public void cameraFailed(String cause) {
        complain(words.get("camera", cause));
    }

    // --- Fingers ---

    @Override
    public boolean onTouch(View touched, MotionEvent event) {
        fingers.touch(event, touched.getWidth(), touched.getHeight());
        return true;
    }

    @Override
    public void moved(float scale, float turn, float x, float y) {
        if (session == 0) return;
        try {
            Native.setGesture(session, scale, turn, x, y);
        } catch (ModarException error) {
            failed(error);
        }
    }

    @Override
    public void tapped(float x, float y) {
        if (!mayUseCamera()) {
            askForCamera();
            return;
        }
        try {
            int model = session == 0 ? -1 : Native.pick(session, x, y);
            if (model < 0) return;
            String name = Native.modelName(session, model);
            notice(texts.getProperty(name, name));
        } catch (ModarException notYet) {
            diagnostics.error(notYet.getMessage());
        }
    }

    @Override
    public void onClick(View clicked) {
        if (clicked == picture) stage.takePicture();
        if (clicked == models) showNext();
        if (clicked == update) startUpdate();
        if (clicked == about) {
            info.setVisibility(info.getVisibility() == View.VISIBLE ? View.GONE : View.VISIBLE);
            follow();
            writeDiagnostics();
        }
    }

    // --- Files ---

    @Override
    public void picture(ByteBuffer rgba, int width, int height) {
        int[] pixels = new int[width * height];
        for (int y = 0; y < height; y++) {
            for (int x = 0; x < width; x++) {
                int at = 4 * ((height - 1 - y) * width + x);
                pixels[y * width + x] = 0xFF000000 | (rgba.get(at) & 0xFF) << 16 | (rgba.get(at + 1) & 0xFF) << 8
                        | (rgba.get(at + 2) & 0xFF);
            }
        }
        final Bitmap bitmap = Bitmap.createBitmap(pixels, width, height, Bitmap.Config.ARGB_8888);
        new Thread(new Runnable() {
            @Override
            public void run() {
                save(bitmap);
            }
        }, "modar-picture").start();
    }

    private void save(Bitmap bitmap) {
        File file = new File(bundles.folder, "picture-" + System.currentTimeMillis() + ".png");
        try {
            FileOutputStream out = new FileOutputStream(file);
            try {
                if (!bitmap.compress(Bitmap.CompressFormat.PNG, 100, out)) throw new IOException("no space is left");
                out.getFD().sync();
            } finally {
                out.close();
            }
            say(words.get("saved", file.getPath()));
        } catch (IOException failed) {
            file.delete(); // nothing half-written stays
            diagnostics.error(failed.getMessage());
            say(words.get("space", failed.getMessage()));
        }
    }

    /** diagnostics.txt in the app's folder, for `adb pull`. */
    private void writeDiagnostics() {
        try {
            FileOutputStream out = new FileOutputStream(new File(bundles.folder, "diagnostics.txt"));
            try {
                out.write(diagnostics.text().getBytes("UTF-8"));
            } finally {
                out.close();
            }
        } catch (IOException full) {
            diagnostics.error(full.getMessage());
        }
    }
}

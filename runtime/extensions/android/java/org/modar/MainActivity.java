package org.modar;

import android.Manifest;
import android.app.Activity;
import android.app.AlertDialog;
import android.content.ActivityNotFoundException;
import android.content.DialogInterface;
import android.content.Intent;
import android.content.pm.PackageManager;
import android.content.res.Configuration;
import android.graphics.Bitmap;
import android.media.AudioManager;
import android.net.Uri;
import android.opengl.GLSurfaceView;
import android.os.Build;
import android.os.Bundle;
import android.os.Handler;
import android.os.Looper;
import android.os.Message;
import android.provider.Settings;
import android.view.Display;
import android.view.MotionEvent;
import android.view.View;
import android.view.ViewGroup;
import android.view.WindowManager;
import android.widget.ImageView;
import android.widget.TextView;
import java.io.File;
import java.io.IOException;
import java.nio.ByteBuffer;
import java.util.List;
import java.util.Locale;

/** The one screen: the camera's picture with models on it, or the models alone; a line of advice, and buttons. */
public final class MainActivity extends Activity implements Handler.Callback, View.OnClickListener {
    /** How often the line of advice follows what the tracker says. */
    private static final int TICK_MS = 500;
    private static final int ASKED_FOR_CAMERA = 1;
    // Messages to the main thread:
    private static final int TICK = 0;
    private static final int NOTICE = 1;
    private static final int TROUBLE = 2;
    private static final int DAMAGED = 3;
    private static final int FETCHED = 4;
    private static final int SAVED = 5;
    private static final int TOLD = 6;
    private static final int ASKED = 7;
    /** How often captions follow the sound. */
    private static final int CAPTION_MS = 100;
    private static final int CAPTION = 8;
    private static final int MARKS = 9;
    private static final int RECORDING = 10;
    private static final int PHOTO = 11;
    private static final int MADE = 12;
    private static final int FIRST = 13;
    private static final int CHOSEN_PICTURE = 2;
    private static final int CHOSEN_MODEL = 3;

    /** Words of what modar.h calls MODAR_HINT_CLOSER and so on. */
    private static final String[] HINTS
            = {"look", "far", "dark", "blurred", "outside", "hold", "bright", "outside", "flat"};
    private static final int[] MENU = {R.id.menu_go, R.id.menu_models, R.id.menu_patterns, R.id.menu_take,
            R.id.menu_choose, R.id.menu_open, R.id.menu_forget, R.id.own_how, R.id.own_use};
    private static final String[] MENU_WORDS = {"menu-go", "menu-models", "menu-patterns", "menu-take", "menu-choose",
            "menu-open", "menu-forget", "own-how", "own-use"};

    private final Handler main = new Handler(Looper.getMainLooper(), this);
    private Diagnostics diagnostics;
    private Words words;
    private Bundles bundles;
    private Photos photos;
    private Stage stage;
    private CameraFeed feed;
    private CameraFeed stopped;
    private boolean resumed;
    private boolean asked;
    /** The phone wanted memory back: what can be made again is gone. */
    private boolean trimmed;

    // The state of the screen:
    private List<Bundles.Source> sources;
    private int source = -1;
    private long session;
    /** The bundle's, then the visitor's own. */
    private String[] patterns = {};
    private int baked;
    private OwnPictures own;
    private Corners corners;
    /** Of the bundle's scenes, and the one that the visitor's next picture gets. */
    private List<String> models;
    private int model;
    /** The next photo is of a picture of the visitor's own. */
    private volatile boolean taking;
    private Texts texts;
    /** Null: the bundle plays nothing. */
    private Media media;
    /** Null: the bundle has no labels. */
    private Marks marks;
    /** The words of a label that an action showed, while its pattern is seen. */
    private String told;
    private int toldOn;
    private String heard = "";
    private TextView caption;
    /** The pattern of a look without the camera; -1: with it. */
    private int around = -1;
    /** An error stays on the screen until something works again; null: advice. */
    private String trouble;
    private long noticeUntil;

    private GLSurfaceView view;
    private ViewGroup screen;
    private String described = "";
    private String said = "";
    private TextView status;
    private ImageView hint;
    private View info;

    @Override
    protected void onCreate(Bundle state) {
        super.onCreate(state);
        words = new Words(getAssets(), Locale.getDefault());
        bundles = new Bundles(this);
        photos = new Photos(this, getString(R.string.title));
        own = new OwnPictures(this);
        diagnostics = new Diagnostics();
        setContentView(R.layout.main);
        BackGesture.sendTo(this);
        screen = (ViewGroup) findViewById(R.id.screen);
        view = (GLSurfaceView) findViewById(R.id.view);
        status = (TextView) findViewById(R.id.status);
        hint = (ImageView) findViewById(R.id.hint);
        info = findViewById(R.id.info);
        caption = (TextView) findViewById(R.id.caption);
        setVolumeControlStream(AudioManager.STREAM_MUSIC);
        corners = new Corners(this, words);
        ((ViewGroup) findViewById(R.id.own_photo)).addView(corners, new ViewGroup.LayoutParams(-1, -1));
        for (int i = 0; i < MENU.length; i++) label(MENU[i], MENU_WORDS[i]);
        label(R.id.picture, "picture");
        label(R.id.record, "record");
        label(R.id.share, "share");
        label(R.id.around, "around");
        label(R.id.models, "models");
        label(R.id.update, "update");
        label(R.id.about, "about");
        showIf(findViewById(R.id.update), Fetch.AVAILABLE);
        stage = new Stage(view, this, diagnostics);
        stage.focal = bundles.focal();
        stage.still = Settings.Global.getFloat(getContentResolver(), Settings.Global.ANIMATOR_DURATION_SCALE, 1) == 0;
        view.setEGLContextClientVersion(2);
        view.setEGLConfigChooser(new Samples());
        view.setPreserveEGLContextOnPause(true);
        view.setRenderer(stage);
        view.setRenderMode(GLSurfaceView.RENDERMODE_WHEN_DIRTY);
        sources = bundles.list();
        showNext();
    }

    private void label(int id, String word) {
        ((TextView) findViewById(id)).setText(words.get(word));
    }

    private static void showIf(View view, boolean shown) {
        view.setVisibility(shown ? View.VISIBLE : View.GONE);
    }

    @Override
    public boolean handleMessage(Message message) {
        switch (message.what) {
            case TICK:
                follow();
                main.sendEmptyMessageDelayed(TICK, TICK_MS);
                break;
            case NOTICE:
                notice((String) message.obj);
                break;
            case TROUBLE:
                trouble = (String) message.obj;
                follow();
                break;
            case DAMAGED:
                drop((Bundles.Source) message.obj);
                break;
            case TOLD:
                show(message.arg1);
                break;
            case ASKED:
                askToLeave((String) message.obj);
                break;
            case CAPTION:
                followSound();
                main.sendEmptyMessageDelayed(CAPTION, CAPTION_MS);
                break;
            case MARKS:
                if (marks != null) marks.follow();
                break;
            case RECORDING:
                label(R.id.record, message.arg1 != 0 ? "stop" : "record");
                break;
            case PHOTO:
                edit((Bitmap) message.obj);
                break;
            case MADE:
                made((OwnPictures.Photo) message.obj);
                break;
            case SAVED:
                showIf(findViewById(R.id.share), true);
                notice(words.get((String) message.obj));
                break;
            case FIRST:
                if (session == 0) showAll();
                else if (source >= 0) relist(sources.get(source));
                break;
            default:
                findViewById(R.id.update).setEnabled(true);
                if (message.arg1 != 0) showAll();
        }
        return true;
    }

    // --- Life ---

    @Override
    protected void onResume() {
        super.onResume();
        resumed = true;
        if (trimmed) screen.addView(view, 0);
        if (trimmed && source >= 0) hint.setImageBitmap(bundles.hint(sources.get(source)));
        trimmed = false;
        view.onResume();
        if (around >= 0) {
            stage.look(around);
        } else if (!mayUseCamera()) {
            if (!asked) askForCamera();
        } else {
            startCamera();
        }
        main.sendEmptyMessage(TICK);
        if (media != null) media.hold(false);
        if (media != null) main.sendEmptyMessage(CAPTION);
    }

    @Override
    protected void onPause() {
        resumed = false;
        main.removeMessages(TICK);
        main.removeMessages(CAPTION);
        if (media != null) media.hold(true);
        stopCamera();
        stage.endRecording();
        view.onPause();
        closeCamera();
        keepFocal();
        writeDiagnostics();
        super.onPause();
    }

    /** The lens measured from the camera's frames is where the next visit starts. */
    private void keepFocal() {
        try {
            double focal = session == 0 ? 0 : Native.focal(session);
            if (focal == 0) return;
            stage.focal = focal;
            bundles.setFocal(focal);
        } catch (ModarException | IOException gone) {
            diagnostics.error(gone.getMessage());
        }
    }

    /** In the background: GL's context with the models, the tracker and the hint can be made again. */
    @Override
    public void onTrimMemory(int level) {
        super.onTrimMemory(level);
        if (resumed || trimmed || level < TRIM_MEMORY_BACKGROUND) return;
        trimmed = true;
        screen.removeView(view);
        hint.setImageBitmap(null);
        try {
            if (session != 0) Native.trim(session);
        } catch (ModarException gone) {
            diagnostics.error(gone.getMessage());
        }
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
        requestPermissions(new String[] {Manifest.permission.CAMERA}, ASKED_FOR_CAMERA);
    }

    @Override
    public void onRequestPermissionsResult(int request, String[] permissions, int[] answers) {
        if (request != ASKED_FOR_CAMERA || !mayUseCamera()) return;
        trouble = null;
        if (resumed) startCamera();
    }

    private void startCamera() {
        if (feed != null || session == 0 || around >= 0) return;
        trouble = null;
        followDisplay();
        try {
            Native.reset(session);
            feed = CameraFeed.create(this, stage, Native.poseCount(session));
            feed.start();
        } catch (ModarException error) {
            failed(error);
        }
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
        if (around >= 0) look(session == 0 ? -1 : 0);
        showMore();
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
        showAll();
        return true;
    }

    private void showAll() {
        sources = bundles.list();
        source = -1;
        showNext();
    }

    /** More bundles can be shown. */
    private void relist(Bundles.Source shown) {
        List<Bundles.Source> all = bundles.list();
        for (int i = 0; i < all.size(); i++) {
            if (!all.get(i).name.equals(shown.name) || !all.get(i).origin.equals(shown.origin)) continue;
            all.set(i, shown);
            sources = all;
            source = i;
            showMore();
            return;
        }
    }

    private void use(int index, long opened) throws ModarException {
        source = index;
        Bundles.Source from = sources.get(index);
        baked = Native.patternCount(opened);
        patterns = new String[baked + own.addTo(opened)];
        for (int i = 0; i < patterns.length; i++)
            patterns[i] = i < baked ? Native.patternName(opened, i) : words.get("own-name");
        models = OwnPictures.models(opened);
        model = 0;
        session = opened;
        texts = new Texts(bundles.texts(from), opened, patterns, Locale.getDefault());
        hint.setImageBitmap(bundles.hint(from));
        diagnostics.bundle = from.name + " (" + from.origin + ")";
        diagnostics.release = Fetch.AVAILABLE ? Fetch.version(bundles.store.getPath()) : "none";
        media = new Media(opened, getCacheDir(), new Runnable() {
            @Override
            public void run() {
                view.requestRender();
            }
        });
        if (media.isEmpty()) media = null;
        marks = new Marks(this, (ViewGroup) findViewById(R.id.marks), this, opened, texts.language);
        if (marks.isEmpty()) marks = null;
        told = null;
        showIf(findViewById(R.id.sound), media != null);
        showIf(findViewById(R.id.pause), media != null);
        main.removeMessages(CAPTION);
        if (media != null && resumed) main.sendEmptyMessage(CAPTION);
        stage.show(opened, bundles.lens(), media, marks);
        from.session = opened;
        showMenu(null);
        if (!bundles.isVerified(from)) new Job("modar-verify", from).start();
    }

    /** Reads every byte of a bundle once after it came, in the background. */
    private void verify(Bundles.Source from) {
        try {
            Native.verify(from.session);
            bundles.setVerified(from);
        } catch (ModarException damaged) {
            diagnostics.error(damaged.getMessage());
            if (damaged.code.equals("android.closed")) return; // another is shown by now
            from.damage = damaged.getMessage();
            main.obtainMessage(DAMAGED, from).sendToTarget();
        } catch (IOException full) {
            diagnostics.error(full.getMessage());
        }
    }

    /** A bundle that is shown turned out to be damaged: the next one, or the reason. */
    private void drop(Bundles.Source damaged) {
        if (source < 0 || sources.get(source) != damaged) return;
        sources.remove(source);
        source = -1;
        stopCamera();
        closeCamera();
        session = 0;
        media = null;
        marks = null;
        ((ViewGroup) findViewById(R.id.marks)).removeAllViews();
        stage.show(0, null, null, null);
        showNext();
        if (session == 0) trouble = words.get("bundle", damaged.damage);
        follow();
    }

    private void startUpdate() {
        String url = "";
        for (File place : getExternalFilesDirs(null)) {
            // A stick or card with a release, if there is one; else the network.
            if (place != null && new File(place, "release/releases").isDirectory()) {
                url = new File(place, "release").getPath();
            }
        }
        try {
            if (url.isEmpty()) url = bundles.asset("release.txt");
            findViewById(R.id.update).setEnabled(false);
            new Job("modar-update", new Update(url, bundles.asset("release.pub"))).start();
        } catch (IOException none) {
            notice(words.get("not-updated", "release.txt"));
        }
    }

    /** Downloads a release in the background. */
    private final class Update extends Transfer {
        private final String url;
        private final String key;

        Update(String url, String key) {
            super(url);
            this.url = url;
            this.key = key;
        }

        @Override
        void first() {
            main.sendEmptyMessage(FIRST);
        }

        @Override
        void progress(long done, long total) {
            say(NOTICE, words.get("fetching", done / 1000, total / 1000));
        }
    }

    private void fetch(Update from) {
        boolean changed = false;
        try {
            changed = Fetch.fetch(from.url, bundles.store.getPath(), from.key, from);
            say(NOTICE, words.get(changed ? "updated" : "current"));
        } catch (ModarException error) {
            diagnostics.error(error.getMessage());
            say(NOTICE, words.get("not-updated", error.getMessage()));
        }
        main.obtainMessage(FETCHED, changed ? 1 : 0, 0).sendToTarget();
    }

    /** What takes a while, on a thread of its own: to verify a bundle, to fetch, to save a picture or a video. */
    private final class Job extends Thread {
        private final Object of;

        Job(String name, Object of) {
            super(name);
            this.of = of;
        }

        @Override
        public void run() {
            if (of instanceof Bundles.Source) verify((Bundles.Source) of);
            if (of instanceof Update) fetch((Update) of);
            if (of instanceof OwnPictures.Photo) make((OwnPictures.Photo) of);
            if (of instanceof Bitmap || of instanceof File) save(of);
        }
    }

    // --- What the screen says ---

    /** The line at the bottom: trouble, a notice, the detected pattern, or advice. */
    private void follow() {
        if (resumed) followDisplay();
        if (media != null) showSwitches();
        if (info.getVisibility() == View.VISIBLE) {
            ((TextView) findViewById(R.id.info_text)).setText(diagnostics.text(words));
        }
        if (System.nanoTime() < noticeUntil) return;
        boolean looking = false;
        String text = trouble == null && taking ? words.get("own-how") : trouble;
        if (text == null) {
            int seen = status()[Native.SHOWN];
            looking = seen < 0;
            text = looking ? advice() : shownOn(seen);
            describe(seen);
        }
        say(text);
        showIf(hint, looking);
    }

    /** See Native.status(). */
    private int[] status() {
        try {
            if (session != 0) return Native.status(session);
        } catch (ModarException gone) {
            diagnostics.error(gone.getMessage());
        }
        return new int[] {0, 0, -1, 0, 0, 0};
    }

    /** A label's words, or the pattern's; and what would be heard there, while nothing is. */
    private String shownOn(int seen) {
        if (told != null && toldOn == seen) return told;
        told = null;
        String text = texts.shown(seen);
        try {
            String all = media == null || texts.language == null || !heard.isEmpty()
                    ? ""
                    : media.transcript(seen, texts.language);
            return text.isEmpty() || all.isEmpty() ? text + all : text + "\n" + all;
        } catch (ModarException gone) {
            return text;
        }
    }

    /** Captions are shown whether there is sound or not. */
    private void followSound() {
        if (media == null || texts.language == null) return;
        try {
            String now = media.caption(texts.language);
            if (now.equals(heard)) return;
            heard = now;
            caption.setText(now);
            showIf(caption, !now.isEmpty());
        } catch (ModarException gone) {
            diagnostics.error(gone.getMessage());
        }
    }

    /** From GL's thread: labels are elsewhere. */
    void marksMoved() {
        main.removeMessages(MARKS); // one is enough
        main.sendEmptyMessage(MARKS);
    }

    /** From GL's thread: an action shows a label's words. */
    void tell(int node) {
        main.obtainMessage(TOLD, node, 0).sendToTarget();
    }

    private void show(int node) {
        if (texts.language == null) return;
        try {
            String title = Native.nodeText(session, node, true, texts.language);
            String text = Native.nodeText(session, node, false, texts.language);
            told = title == null ? text : text == null ? title : title + "\n" + text;
            toldOn = Native.node(session, node)[Native.PATTERN];
            follow();
        } catch (ModarException gone) {
            diagnostics.error(gone.getMessage());
        }
    }

    /** From GL's thread: an action wants to leave the app. */
    void ask(String address) {
        main.obtainMessage(ASKED, address).sendToTarget();
    }

    /** Nothing leaves the app unasked, and only to where connections are encrypted. */
    private void askToLeave(final String address) {
        if (address == null || !address.startsWith("https://")) return;
        new AlertDialog.Builder(this)
                .setMessage(words.get("leave", address))
                .setNegativeButton(words.get("stay"), null)
                .setPositiveButton(words.get("open"),
                        new DialogInterface.OnClickListener() {
                            @Override
                            public void onClick(DialogInterface dialog, int which) {
                                try {
                                    startActivity(new Intent(Intent.ACTION_VIEW, Uri.parse(address)));
                                } catch (ActivityNotFoundException none) {
                                    diagnostics.error(none.getMessage());
                                }
                            }
                        })
                .show();
    }

    /** A description of the view, for screen readers. */
    private void describe(int seen) {
        String alternative = seen < 0 ? words.get("view") : texts.alternative(seen);
        String text = alternative != null ? alternative : words.get("seen", texts.name(patterns[seen]));
        if (text.equals(described)) return;
        described = text;
        view.setContentDescription(text);
    }

    /** A screen reader speaks what changes. */
    private void say(String text) {
        if (!text.equals(said)) status.setText(text);
        said = text;
        showIf(status, !text.isEmpty());
    }

    /** What to look for, and what the tracker misses. */
    private String advice() {
        StringBuilder names = new StringBuilder();
        for (String pattern : patterns) {
            if (names.length() > 0) names.append(", ");
            names.append(texts.name(pattern));
        }
        String look = words.get("look", names);
        int hint = status()[Native.HINT];
        return hint == 0 ? look : look + "\n" + words.get(HINTS[hint]);
    }

    private void notice(String text) {
        noticeUntil = System.nanoTime() + 3000000000L;
        say(text);
    }

    /** From any thread. what: NOTICE or TROUBLE. */
    private void say(int what, String text) {
        main.obtainMessage(what, text).sendToTarget();
    }

    private void complain(String text) {
        diagnostics.error(text);
        say(TROUBLE, text);
    }

    /** From any thread. */
    void failed(ModarException error) {
        complain(words.get(error.code.startsWith("gl.") ? "gl" : "bundle", error.getMessage()));
    }

    /** From any thread. */
    void cameraFailed(String cause) {
        complain(words.get("camera", cause));
    }

    // --- Without the camera ---

    /** From the camera's picture to the models alone, and back. */
    private void lookAround() {
        if (session == 0 || baked == 0) return;
        look(around < 0 ? Math.max(0, status()[Native.SHOWN]) % baked : -1);
    }

    private void look(int pattern) {
        around = pattern;
        if (around >= 0) {
            trouble = null;
            stopCamera();
            closeCamera();
        }
        stage.look(around);
        label(R.id.around, around < 0 ? "around" : "camera-again");
        showMore();
        if (around < 0 && resumed) {
            if (mayUseCamera()) startCamera();
            else askForCamera();
        }
        follow();
    }

    private void showMore() {
        showIf(findViewById(R.id.models), sources.size() > 1 || (around >= 0 && baked > 1));
    }

    // --- The menu, and the visitor's own pictures ---

    /** View.VISIBLE, View.GONE, or null: unchanged. */
    private void showMenu(Boolean shown) {
        if (shown != null) showIf(findViewById(R.id.menu), shown);
        boolean may = session != 0 && !models.isEmpty();
        showIf(findViewById(R.id.menu_models), session != 0 && sources.size() > 1);
        showIf(findViewById(R.id.menu_patterns), session != 0 && baked > 0);
        showIf(findViewById(R.id.menu_take), may);
        showIf(findViewById(R.id.menu_choose), may);
        showIf(findViewById(R.id.menu_model), may && models.size() > 1);
        showIf(findViewById(R.id.menu_forget), !own.isEmpty());
        if (may)
            ((TextView) findViewById(R.id.menu_model)).setText(words.get("menu-model", texts.model(models.get(model))));
    }

    /** Points the camera at the visitor's future picture, without models. */
    private void take(boolean on) {
        taking = on;
        stage.setBare(on);
        label(R.id.picture, on ? "own-take" : "picture");
        if (on && around >= 0) look(-1);
        follow();
    }

    /** A list over the camera's picture; back closes it. */
    private void choose(String title, String[] names, final boolean bundle) {
        new AlertDialog.Builder(this)
                .setTitle(words.get(title))
                .setItems(names,
                        new DialogInterface.OnClickListener() {
                            @Override
                            public void onClick(DialogInterface dialog, int which) {
                                showMenu(false);
                                if (bundle) showFrom(which);
                                else look(which);
                            }
                        })
                .show();
    }

    private void chooseBundle() {
        String[] names = new String[sources.size()];
        for (int i = 0; i < names.length; i++) names[i] = sources.get(i).name;
        choose("menu-models", names, true);
    }

    private void choosePattern() {
        String[] names = new String[baked];
        for (int i = 0; i < baked; i++) names[i] = texts.name(patterns[i]);
        choose("menu-patterns", names, false);
    }

    /** That bundle, or the next that can be opened. */
    private void showFrom(int index) {
        source = index - 1;
        look(-1);
        showNext();
    }

    /** A bundle of another app: it is in this one's folder from now on. */
    private void addBundle(Uri from) {
        try {
            File added = bundles.add(from);
            sources = bundles.list();
            for (int i = 0; i < sources.size(); i++) {
                if (added.equals(sources.get(i).file)) showFrom(i);
            }
            showMenu(false);
        } catch (IOException unreadable) {
            notice(words.get("space", unreadable.getMessage()));
        } catch (ModarException | RuntimeException refused) { // other apps throw what they like
            notice(words.get("bundle", refused.getMessage()));
        }
    }

    /** kind: a MIME type. Another app answers. */
    private void askFor(String kind, int request) {
        Intent choose = new Intent(Intent.ACTION_GET_CONTENT);
        choose.setType(kind);
        choose.addCategory(Intent.CATEGORY_OPENABLE);
        try {
            startActivityForResult(choose, request);
        } catch (ActivityNotFoundException none) {
            diagnostics.error(none.getMessage());
        }
    }

    @Override
    protected void onActivityResult(int request, int result, Intent answer) {
        if (result != RESULT_OK || answer == null || answer.getData() == null) return;
        if (request == CHOSEN_MODEL) addBundle(answer.getData());
        if (request != CHOSEN_PICTURE) return;
        try {
            edit(own.read(answer.getData()));
        } catch (IOException | RuntimeException refused) { // other apps throw what they like
            notice(words.get("own-unreadable", refused.getMessage()));
        }
    }

    /** Its corners are shown, to be corrected; null: back. */
    private void edit(Bitmap photo) {
        if (taking) take(false);
        corners.show(photo);
        findViewById(R.id.own_use).setEnabled(photo != null);
        showIf(findViewById(R.id.own), photo != null);
        showMenu(false);
    }

    private void useOwn() {
        Bitmap photo = corners.photo();
        findViewById(R.id.own_use).setEnabled(false);
        new Job("modar-own",
                new OwnPictures.Photo(corners.pixels(), photo.getWidth(), photo.getHeight(), corners.at.clone(), model))
                .start();
    }

    /** In the background. */
    private void make(OwnPictures.Photo photo) {
        try {
            photo.make();
            own.keep(photo);
        } catch (ModarException plain) {
            diagnostics.error(plain.getMessage());
            say(NOTICE, words.get("own-plain"));
        } catch (IOException full) { // it works until the app ends
            diagnostics.error(full.getMessage());
        }
        main.obtainMessage(MADE, photo).sendToTarget();
    }

    /** Looks for the new picture as well: from now on, and on later visits. */
    private void made(OwnPictures.Photo photo) {
        findViewById(R.id.own_use).setEnabled(true);
        if (photo.record == null || session == 0) return;
        edit(null);
        reopen();
    }

    /** The bundle that is shown, with the visitor's pictures that are kept now. */
    private void reopen() {
        source--;
        showNext();
        showMenu(null);
    }

    @Override
    public void onBackPressed() {
        if (findViewById(R.id.own).getVisibility() == View.VISIBLE) edit(null);
        else if (taking) take(false);
        else if (findViewById(R.id.menu).getVisibility() == View.VISIBLE) {
            super.onBackPressed();
            return;
        }
        showMenu(true);
    }

    // --- Gestures ---

    @Override
    public boolean onTouchEvent(MotionEvent event) {
        int action = event.getActionMasked();
        boolean down = action == MotionEvent.ACTION_DOWN || action == MotionEvent.ACTION_POINTER_DOWN;
        boolean up = action == MotionEvent.ACTION_UP || action == MotionEvent.ACTION_POINTER_UP;
        if (down || up) {
            touch(event, event.getActionIndex(), down ? 0 : 2);
        } else if (action == MotionEvent.ACTION_MOVE || action == MotionEvent.ACTION_CANCEL) {
            for (int i = 0; i < event.getPointerCount(); i++)
                touch(event, i, action == MotionEvent.ACTION_MOVE ? 1 : 3);
        }
        return true;
    }

    private void touch(MotionEvent event, int index, int kind) {
        float x = event.getX(index);
        float y = event.getY(index);
        try {
            int done = session == 0 ? 0 : Native.touch(session, kind, event.getPointerId(index), x, y);
            if (done == Native.MOVED && around >= 0) view.requestRender();
            if (done == Native.TAPPED || (session == 0 && kind == 2)) tapped(x, y);
        } catch (ModarException error) {
            failed(error);
        }
    }

    private void tapped(float x, float y) {
        if (around < 0 && !mayUseCamera()) {
            askForCamera();
            return;
        }
        try {
            told = null;
            int model = session == 0 ? -1 : Native.pick(session, x, y);
            stage.tapped();
            if (model < 0) return;
            String name = Native.modelName(session, model);
            notice(texts.model(name));
        } catch (ModarException notYet) {
            diagnostics.error(notYet.getMessage());
        }
    }

    private void touchMark(int node) {
        try {
            told = null;
            Native.tapNode(session, node);
            stage.tapped();
        } catch (ModarException gone) {
            diagnostics.error(gone.getMessage());
        }
    }

    /** Of the buttons, by res/layout/main.xml, and of labels' marks. */
    @Override
    public void onClick(View clicked) {
        if (clicked.getTag() != null) {
            touchMark((Integer) clicked.getTag());
            return;
        }
        switch (clicked.getId()) {
            case R.id.picture:
                stage.takePicture();
                break;
            case R.id.menu_go:
                showMenu(false);
                break;
            case R.id.menu_take:
                showMenu(false);
                take(true);
                break;
            case R.id.menu_models:
                chooseBundle();
                break;
            case R.id.menu_patterns:
                choosePattern();
                break;
            case R.id.menu_choose:
                askFor("image/*", CHOSEN_PICTURE);
                break;
            case R.id.menu_open:
                askFor("*/*", CHOSEN_MODEL);
                break;
            case R.id.menu_model:
                model = (model + 1) % models.size();
                showMenu(null);
                break;
            case R.id.menu_forget:
                own.forget();
                reopen();
                break;
            case R.id.own_use:
                useOwn();
                break;
            case R.id.record:
                stage.record(getCacheDir());
                break;
            case R.id.share:
                share();
                break;
            case R.id.around:
                lookAround();
                break;
            case R.id.models:
                if (around >= 0 && around + 1 < baked) {
                    look(around + 1);
                } else {
                    showNext();
                }
                break;
            case R.id.sound:
                press(Native.PRESS_SOUND);
                break;
            case R.id.pause:
                press(Native.PRESS_PAUSE);
                break;
            case R.id.update:
                startUpdate();
                break;
            default:
                showIf(info, info.getVisibility() != View.VISIBLE);
                follow();
                writeDiagnostics();
        }
    }

    private void press(int button) {
        try {
            Native.press(session, button);
            media.follow();
            showSwitches();
        } catch (ModarException gone) {
            diagnostics.error(gone.getMessage());
        }
    }

    /** What a touch of the buttons does next. */
    private void showSwitches() {
        int[] now = status();
        label(R.id.sound, now[Native.HEARD] != 0 ? "silence" : "sound");
        label(R.id.pause, now[Native.PAUSED] != 0 ? "play" : "pause");
    }

    // --- Files ---

    /** On GL's thread: the last drawing, rows from the bottom up. */
    void picture(ByteBuffer rgba, int width, int height) {
        int[] pixels = new int[width * height];
        for (int y = 0; y < height; y++) {
            for (int x = 0; x < width; x++) {
                int at = 4 * ((height - 1 - y) * width + x);
                pixels[y * width + x] = 0xFF000000 | (rgba.get(at) & 0xFF) << 16 | (rgba.get(at + 1) & 0xFF) << 8
                        | (rgba.get(at + 2) & 0xFF);
            }
        }
        Bitmap bitmap = Bitmap.createBitmap(pixels, width, height, Bitmap.Config.ARGB_8888);
        if (taking) {
            main.obtainMessage(PHOTO, OwnPictures.small(bitmap)).sendToTarget();
            return;
        }
        new Job("modar-picture", bitmap).start();
    }

    /** On GL's thread: a video begins or ends. */
    void recording(boolean on) {
        main.obtainMessage(RECORDING, on ? 1 : 0, 0).sendToTarget();
    }

    /** On GL's thread. */
    void recorded(File video) {
        new Job("modar-video", video).start();
    }

    /** From any thread. */
    void notRecorded(Exception cause) {
        diagnostics.error(String.valueOf(cause.getMessage()));
        say(NOTICE, words.get("not-recorded", cause.getMessage()));
    }

    private void save(Object what) {
        try {
            photos.save(what);
            main.obtainMessage(SAVED, what instanceof File ? "saved-video" : "saved").sendToTarget();
        } catch (IOException | RuntimeException refused) { // galleries throw what they like: no card, no storage
            diagnostics.error(refused.getMessage());
            say(NOTICE, words.get("space", refused.getMessage()));
        }
        if (what instanceof File) ((File) what).delete();
    }

    private void share() {
        try {
            if (photos.newest != null) startActivity(photos.share());
        } catch (ActivityNotFoundException none) {
            diagnostics.error(none.getMessage());
        }
    }

    /** diagnostics.txt in the app's folder, for `adb pull`. */
    private void writeDiagnostics() {
        try {
            Bundles.write(new File(bundles.folder, "diagnostics.txt"), diagnostics.text(words), false);
        } catch (IOException full) {
            diagnostics.error(full.getMessage());
        }
    }
}

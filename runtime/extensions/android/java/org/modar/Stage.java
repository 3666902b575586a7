package org.modar;

import android.opengl.GLES20;
import android.opengl.GLSurfaceView;
import java.io.File;
import java.nio.ByteBuffer;
import javax.microedition.khronos.egl.EGLConfig;
import javax.microedition.khronos.opengles.GL10;

/** Between the camera's thread, which tracks, and GL's, which draws: the newest frame goes over, with its poses. */
final class Stage implements GLSurfaceView.Renderer {
    private final GLSurfaceView view;
    private final MainActivity screen;
    private final Diagnostics diagnostics;
    private final FrameHandover frames = new FrameHandover();
    /** Behind models without the camera: a light gray, on which black and white ones have an outline. */
    private static final float GROUND = 0.85f;
    /** Set false by tests: searches in step with the frames, so that results do not depend on time. */
    static volatile boolean searchApart = true;

    private volatile long session;
    private volatile String cameraFile;
    /** What Native.focal() said of this phone's camera before; 0: unknown. */
    volatile double focal;
    /** The pattern of a look without the camera; -1: with it. */
    private volatile int around = -1;
    /** Without animations: the look does not begin by a turn. */
    volatile boolean still;
    /** A camera has another clock: what acts begins anew. */
    private volatile boolean wantsReset;
    private volatile Media media;
    /** Null: the bundle has no labels. */
    private volatile Marks marks;
    private volatile boolean wantsPicture;
    /** The camera's picture alone: for a photo of the visitor's own picture. */
    private volatile boolean bare;
    private volatile int displayDegrees;
    private volatile int sensorDegrees;

    // GL's thread alone:
    private Poses lookedAt;
    private long prepared;
    private int width;
    private int height;
    private int turned = -1;
    private String profile;
    /** Null: no video is recorded. */
    private Recorder recorder;

    Stage(GLSurfaceView view, MainActivity screen, Diagnostics diagnostics) {
        this.view = view;
        this.screen = screen;
        this.diagnostics = diagnostics;
    }

    /** The bundle to show; the camera is stopped. The one before is closed by GL's thread, which holds its buffers. */
    void show(long opened, String lens, Media plays, Marks points) {
        final long before = session;
        final Media played = media;
        media = plays;
        marks = points;
        cameraFile = lens;
        session = opened;
        wantsReset = true;
        dropFrames();
        view.queueEvent(new Runnable() {
            @Override
            public void run() {
                if (played != null) played.close();
                Native.close(before);
            }
        });
    }

    /** How the phone is held: what Display.getRotation() says, in degrees. */
    void setDisplayDegrees(int degrees) {
        displayDegrees = degrees;
    }

    /** Hits of pick() go to the actions of the next frame. */
    void tapped() {
        view.requestRender();
    }

    /** With the camera stopped. pattern: what to look at, or -1 for the camera's picture again. */
    void look(int pattern) {
        if (pattern != around) wantsReset = true;
        around = pattern;
        view.requestRender();
    }

    void setBare(boolean on) {
        bare = on;
        view.requestRender();
    }

    void takePicture() {
        wantsPicture = true;
        view.requestRender();
    }

    /** Begins a video in a folder, or ends the one that is recorded. */
    void record(final File folder) {
        view.queueEvent(new Runnable() {
            @Override
            public void run() {
                if (recorder != null) stopRecording(false);
                else startRecording(folder);
            }
        });
        view.requestRender();
    }

    /** Before GL pauses: the recording is saved. */
    void endRecording() {
        view.queueEvent(new Runnable() {
            @Override
            public void run() {
                stopRecording(false);
            }
        });
    }

    /** With the camera stopped and GL paused, or before a new bundle: all frames go back. */
    void dropFrames() {
        frames.drop();
    }

    // --- The camera's thread ---

    /** Before the first frame. turn: degrees that a frame is turned clockwise to be upright on the sensor's phone. */
    void cameraOpened(int frameWidth, int frameHeight, int turn) {
        sensorDegrees = turn;
        diagnostics.camera = frameWidth + " x " + frameHeight + ", turned by " + turn;
        diagnostics.frameBytes = frameWidth * frameHeight * 3L / 2;
        try {
            Native.setCamera(session, frameWidth, frameHeight, cameraFile, focal, searchApart, true);
        } catch (ModarException error) {
            screen.failed(error);
        }
    }

    /** Takes a frame over, to release it. */
    void frame(Frame frame) {
        long start = System.nanoTime();
        try {
            int visible = frame.track(session);
            diagnostics.tracked(System.nanoTime() - start, visible > 0);
        } catch (ModarException error) {
            frame.release();
            screen.failed(error);
            return;
        }
        frame.drawn = false;
        frames.put(frame);
        view.requestRender();
    }

    void cameraFailed(String cause) {
        screen.cameraFailed(cause);
    }

    // --- GL's thread ---

    @Override
    public void onSurfaceCreated(GL10 gl, EGLConfig config) {
        String renderer = gl.glGetString(GL10.GL_RENDERER);
        profile = Diagnostics.profileOf(renderer);
        diagnostics.gl = renderer + "; " + gl.glGetString(GL10.GL_VERSION);
        diagnostics.profile = profile == null ? "none, the context's own limits" : profile;
        prepared = 0;
        stopRecording(true);
    }

    @Override
    public void onSurfaceChanged(GL10 gl, int newWidth, int newHeight) {
        if (newWidth != width || newHeight != height) stopRecording(false);
        width = newWidth;
        height = newHeight;
        turned = -1;
    }

    @Override
    public void onDrawFrame(GL10 gl) {
        try {
            draw(frames.take());
        } finally {
            frames.done();
        }
    }

    /** shown: the newest frame, or null. */
    private void draw(Frame shown) {
        long start = System.nanoTime();
        try {
            prepare();
            int pattern = session == 0 ? -1 : around;
            float ground = pattern >= 0 ? GROUND : 0;
            if (pattern >= 0 || shown == null) {
                GLES20.glClearColor(ground, ground, ground, 1);
                GLES20.glClear(GLES20.GL_COLOR_BUFFER_BIT | GLES20.GL_DEPTH_BUFFER_BIT);
            }
            if (pattern >= 0) {
                double now = System.nanoTime() * 1e-9;
                if (lookedAt == null || lookedAt.count <= pattern) lookedAt = new Poses(Native.poseCount(session));
                lookedAt.show(pattern);
                act(now, lookedAt);
                Native.onDrawOrbit(session, pattern, now);
                if (Native.waiting(session)) view.requestRender();
            } else if (shown != null) {
                if (bare) shown.poses.clear();
                act(shown.timeS, shown.poses);
                if (shown.drawn) diagnostics.drawnAgain();
                shown.draw(session);
                shown.drawn = true;
            } else {
                return;
            }
            Marks points = marks;
            if (points != null) {
                points.look();
                screen.marksMoved();
            }
        } catch (ModarException error) {
            screen.failed(error);
            return;
        }
        diagnostics.drawn(System.nanoTime() - start);
        record();
        if (wantsPicture) {
            wantsPicture = false;
            ByteBuffer rgba = ByteBuffer.allocateDirect(4 * width * height);
            GLES20.glReadPixels(0, 0, width, height, GLES20.GL_RGBA, GLES20.GL_UNSIGNED_BYTE, rgba);
            screen.picture(rgba, width, height);
        }
    }

    private void startRecording(File folder) {
        if (session == 0 || width == 0) return;
        try {
            Native.share(session);
            recorder = new Recorder(File.createTempFile("video", ".mp4", folder), width, height, media);
            screen.recording(true);
        } catch (Exception refused) { // encoders throw what they like: busy, no such size, no space
            screen.notRecorded(refused);
        }
    }

    private void record() {
        if (recorder == null) return;
        try {
            if (!recorder.frame(width, height)) stopRecording(false);
        } catch (RuntimeException broken) {
            stopRecording(false);
        }
    }

    private void stopRecording(boolean lost) {
        if (recorder == null) return;
        Recorder ended = recorder;
        recorder = null;
        screen.recording(false);
        try {
            File video = ended.finish(lost);
            if (video != null) screen.recorded(video);
        } catch (RuntimeException broken) {
            screen.notRecorded(broken);
        }
    }

    /** What the bundle's actions ask for, and the newest pictures of its videos. */
    private void act(double timeS, Poses poses) throws ModarException {
        Media plays = media;
        if (wantsReset && around >= 0) Native.lookAround(session, around, timeS, !still);
        else if (wantsReset) Native.resetActions(session);
        wantsReset = false;
        if (plays != null) plays.tellEnded();
        int[] commands = Native.act(session, timeS, poses.bytes);
        if (commands != null) {
            if (plays != null) plays.execute(commands);
            for (int i = 0; i < commands.length; i += 3) {
                if (commands[i] == Native.TEXT) screen.tell(commands[i + 1]);
                if (commands[i] == Native.LINK) screen.ask(Native.address(session, commands[i + 2]));
            }
        }
        if (plays != null) plays.upload();
    }

    /** A new context, a new bundle, a turned phone. */
    private void prepare() throws ModarException {
        long now = session;
        if (now == 0) return;
        if (prepared != now) {
            Native.onSurfaceCreated(now, profile);
            if (media != null) media.renew();
            diagnostics.gpuBytes = Native.gpuBytes(now);
            prepared = now;
            turned = -1;
        }
        int turn = ((sensorDegrees - displayDegrees) % 360 + 360) % 360;
        if (turned == turn) return;
        Native.onSurfaceChanged(now, width, height, turn, false);
        turned = turn;
    }
}

package org.modar;

import java.nio.ByteBuffer;

/**
 * libmodar_jni.so: the C API (modar.h) with the entry points of the ModAR paper. A session is an open bundle
 * with its tracker and renderer. The camera's thread tracks while GL's thread draws; close() waits for both.
 * A closed session throws "android.closed", null or small buffers throw "android.buffer".
 */
public final class Native {
    static {
        System.loadLibrary("modar_jni");
    }

    private Native() {}

    /** 10000 * major + 100 * minor + patch. */
    public static native int version();

    /** `length` bytes from `offset` of an open file (an asset of the APK); the descriptor may be closed then. */
    public static native long openFd(int fd, long offset, long length) throws ModarException;

    public static native long openFile(String path) throws ModarException;

    /** Closing twice is fine. */
    public static native void close(long session);

    /** Reads the whole bundle and compares the hash of each section. */
    public static native void verify(long session) throws ModarException;

    /** The bundle's, then those of addPattern(). */
    public static native int patternCount(long session) throws ModarException;

    /** A pose a pattern, then those of the patterns' second copies, and so on. */
    public static native int poseCount(long session) throws ModarException;

    /** The model of a scene, by index from 0 on; -1: no more. */
    public static native int sceneModel(long session, int index) throws ModarException;

    /**
     * With the camera stopped and no frame in use, before setCamera(): a picture of the visitor's own is looked for as well.
     *
     * @param record of photoRecord()
     * @param scene its content */
    public static native void addPattern(long session, byte[] record, int scene) throws ModarException;

    /**
     * The corners of one flat thing in a photo, x and y clockwise from the top left; false: there is no such thing.
     *
     * @param argb as Bitmap.getPixels() gives them
     */
    public static native boolean photoCorners(int[] argb, int width, int height, float[] corners) throws ModarException;

    /** What the picture between the corners is recognised by: takes a second on a phone. "pattern.plain": there is too little in it. */
    public static native byte[] photoRecord(int[] argb, int width, int height, float[] corners) throws ModarException;

    public static native String patternName(long session, int index) throws ModarException;

    public static native String modelName(long session, int index) throws ModarException;

    /** Languages of the bundle's texts as BCP 47 tags, by index from 0 on; null: no more. */
    public static native String language(long session, int index) throws ModarException;

    /**
     * A pattern's text in a language of language(), or null.
     *
     * @param alternative the view in words, for screen readers, instead of advice
     */
    public static native String patternText(long session, int pattern, boolean alternative, String language)
            throws ModarException;

    /**
     * The size of the camera's frames, and its lens.
     *
     * @param file what `modar calibrate` wrote; null: the focal length is estimated from the frames
     * @param focal what focal() said of the same camera, to start from; 0: unknown
     * @param searchApart searches for patterns on a thread of its own; then results depend on time
     * @param extended learns the static surroundings of a pattern, and continues from them while
     * the pattern is out of sight
     */
    public static native void setCamera(long session, int width, int height, String file, double focal,
            boolean searchApart, boolean extended) throws ModarException;

    /** The estimated focal length as a share of the frame's longer side once it is known well, else 0. */
    public static native double focal(long session) throws ModarException;

    /**
     * Before a frame, for `extended`: how the phone turned since the last one, as Sensor.TYPE_GYROSCOPE says.
     *
     * @param x radians, as y and z: a rotation vector in the axes of Android's sensors
     * @param sensorDegrees the camera's SENSOR_ORIENTATION: frames turned clockwise by it are upright
     * @param front the camera is on the screen's side
     */
    public static native void onTurn(long session, double x, double y, double z, int sensorDegrees, boolean front)
            throws ModarException;

    /**
     * Tracks a frame in NV21.
     *
     * @param timeS seconds, rising
     * @param poses direct, Poses.BYTES each of poseCount(), native order; see {@link Poses}
     * @return how many patterns are visible
     */
    public static native int onCameraFrame(long session, byte[] nv21, double timeS, ByteBuffer poses)
            throws ModarException;

    /** The same with the luma plane of YUV_420_888: a direct buffer. */
    public static native int onCameraPlane(long session, ByteBuffer luma, int stride, double timeS, ByteBuffer poses)
            throws ModarException;

    /** Why nothing is visible: "few matches"...; "visible" where something is. */
    public static native String reason(long session) throws ModarException;

    /** Forgets all tracks: after a pause. */
    public static native void reset(long session) throws ModarException;

    /** Frees the tracker's memory, until setCamera(). */
    public static native void trim(long session) throws ModarException;

    /** GL's projection of the camera into 16 floats of a direct buffer, column-major. */
    public static native void projection(long session, double nearPlane, double farPlane, ByteBuffer matrix)
            throws ModarException;

    /** On GL's thread, each time there is a new context. device: a profile like "mali400", or null. */
    public static native void onSurfaceCreated(long session, String device) throws ModarException;

    /**
     * @param rotation degrees that a frame is turned clockwise to be upright on the surface: 0, 90, 180, 270
     * @param mirror true for the front camera
     */
    public static native void onSurfaceChanged(long session, int width, int height, int rotation, boolean mirror)
            throws ModarException;

    public static final int MOVED = 1;
    public static final int TAPPED = 2;

    /**
     * A finger on the surface: see modar_screen_touch().
     *
     * @param kind 0 down, 1 moved, 2 up, 3 cancelled
     * @return 0, MOVED or TAPPED
     */
    public static native int touch(long session, int kind, int finger, float x, float y) throws ModarException;

    // Buttons, and words of status().
    public static final int PRESS_SOUND = 4;
    public static final int PRESS_PAUSE = 5;
    public static final int HINT = 1;
    public static final int SHOWN = 2;
    public static final int HEARD = 3;
    public static final int PAUSED = 4;

    /** A button: see modar_screen_press(). */
    public static native void press(long session, int button) throws ModarException;

    /** See modar_status: six words; SHOWN is an index or -1. */
    public static native int[] status(long session) throws ModarException;

    /** A look without a camera from now on, until resetActions(). present: it goes once around at first. */
    public static native void lookAround(long session, int pattern, double timeS, boolean present)
            throws ModarException;

    /** Something turns by itself: draw on. */
    public static native boolean waiting(long session) throws ModarException;

    /** Draws the frame and the content of its patterns. again: the frame that was drawn last, which is not uploaded again. */
    public static native void onDrawFrame(long session, byte[] nv21, ByteBuffer poses, boolean again)
            throws ModarException;

    /** The model of a clip, by index from 0; -1: no more. */
    public static native int clipModel(long session, int clip) throws ModarException;

    public static native String clipName(long session, int clip) throws ModarException;

    /**
     * From the next act() on, a scene's model plays a clip of its own from the beginning.
     *
     * @param loops false: its last pose stays
     * @param blendS seconds in which the present pose turns into it, usually 0.3
     * @return false: the model has no such clip
     */
    public static native boolean playClip(long session, int scene, int clip, boolean loops, double blendS)
            throws ModarException;

    /** The pose stays. */
    public static native void stopClip(long session, int scene) throws ModarException;

    /** The clip that moves a scene's model; -1: none does, or it has ended. */
    public static native int clipPlaying(long session, int scene) throws ModarException;

    /** The same with the planes of YUV_420_888, with the strides that the Image states. */
    public static native void onDrawPlanes(long session, ByteBuffer y, int yStride, ByteBuffer u, ByteBuffer v,
            int uvStride, int uvPixelStride, ByteBuffer poses, boolean again) throws ModarException;

    /**
     * Draws the content of a pattern without a camera, for an eye that goes around it: see
     * modar_orbit(). The surface is cleared before.
     */
    public static native void onDrawOrbit(long session, int pattern, double timeS) throws ModarException;

    /** The model drawn last under a touch (pixels from the surface's top left), or -1; by onDrawOrbit() as well. */
    public static native int pick(long session, float x, float y) throws ModarException;

    // Scenes that act: commands of act().
    public static final int PLAY = 1;
    public static final int PAUSE = 2;
    public static final int TEXT = 6;
    public static final int LINK = 7;
    // Words of node(), and three of its kinds.
    public static final int KIND = 0;
    public static final int PATTERN = 1;
    public static final int LOOPS = 2;
    public static final int WIDTH = 3;
    public static final int HEIGHT = 4;
    public static final int HAS_SOUND = 5;
    public static final int LABEL = 3;
    public static final int VIDEO = 4;
    public static final int SOUND = 5;

    /**
     * Runs the bundle's actions, before a frame is drawn. The nodes hit by pick() since the last
     * time are the taps.
     *
     * @param timeS seconds, rising
     * @param poses the frame's: the content shown there is on the screen
     * @return three words a command: what to do, the node, the action; null: nothing
     */
    public static native int[] act(long session, double timeS, ByteBuffer poses) throws ModarException;

    /** A video or sound that does not loop came to its end. */
    public static native void ended(long session, int node) throws ModarException;

    /** Nodes and gestures as at the start: before another clock. */
    public static native void resetActions(long session) throws ModarException;

    /** The nodes of a pattern, by index from 0: six words; null: no more. */
    public static native int[] node(long session, int index) throws ModarException;

    /** The MP4 file of a video or sound: in the bundle, until close(). Read only. */
    public static native ByteBuffer media(long session, int node) throws ModarException;

    /** The title or the text of a label, or null. */
    public static native String nodeText(long session, int node, boolean title, String language) throws ModarException;

    /** The text of a label's mark: a number or a short word. */
    public static native String mark(long session, int node) throws ModarException;

    /**
     * Where a label is in the last drawing, on GL's thread.
     *
     * @param look whether something before it is looked for, which reads models: not for each label in each frame
     * @param place x and y in pixels from the surface's top left, and 1 where something covers it
     * @return false: it is hidden, or not on the side of the camera that is seen
     */
    public static native boolean label(long session, int node, boolean look, float[] place) throws ModarException;

    /** The visitor touched a view that represents a node: told to the next act(). */
    public static native void tapNode(long session, int node) throws ModarException;

    /** The captions of a node at a time, seconds, or with a time below 0 all of them; null: nothing. */
    public static native String caption(long session, int node, String language, double seconds) throws ModarException;

    /** Of an action that opens a link: begins with https://. */
    public static native String address(long session, int action) throws ModarException;

    /** What a video shows from now on: a 2D texture of the context, its first row on top; 0: its poster. On GL's thread. */
    public static native void setVideo(long session, int node, int texture) throws ModarException;

    /** From now on others draw in the context as well, as the copies of videos do: the renderer sets its state anew. On GL's thread. */
    public static native void share(long session) throws ModarException;

    /** GL memory that the bundle takes. */
    public static native long gpuBytes(long session) throws ModarException;
}

package org.modar;

import android.media.MediaCodec;
import android.media.MediaCodecInfo;
import android.media.MediaCrypto;
import android.media.MediaFormat;
import android.media.MediaMuxer;
import android.opengl.EGL14;
import android.opengl.EGLConfig;
import android.opengl.EGLContext;
import android.opengl.EGLDisplay;
import android.opengl.EGLExt;
import android.opengl.EGLSurface;
import android.opengl.GLES20;
import android.os.SystemClock;
import android.view.Surface;
import java.io.File;
import java.io.IOException;
import java.nio.ByteBuffer;

/**
 * A video of what the screen shows, with the bundle's sound: frames are copied on the graphics chip
 * to the phone's H.264 encoder. On GL's thread; needs what Android has had since 4.3.
 */
final class Recorder {
    /** Microseconds after which it ends by itself: as on the page. */
    private static final long MOST_US = 30000000L;
    private static final String TYPE = "video/avc";
    /** Of the longer side, pixels: encoders of 2013 take no more at 30 frames a second. */
    private static final int LONGEST = 1280;
    /** Sides are multiples of this, which some encoders ask for; of shares of the screen less than half a percent is stretched. */
    private static final int BLOCK = 16;
    private static final int FRAMES_S = 30;
    /** A pixel: 3.3 Mbit/s at 1280 x 720, about what phones' own cameras take for half of that. */
    private static final double BITS = 0.12;
    /** At its end an encoder gives back what it holds: tries of this many microseconds each. */
    private static final int WAIT_US = 10000;
    private static final int TRIES = 200;
    private static final float[] AS_IT_IS = {1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 0, 0, 1, 0, 1};

    private final File file;
    private final int width;
    private final int height;
    private final MediaCodec encoder;
    private final Surface input;
    private final MediaMuxer muxer;
    private final Soundtrack sound;
    private final MediaCodec.BufferInfo about = new MediaCodec.BufferInfo();
    private final VideoCopy copy = new VideoCopy(GLES20.GL_TEXTURE_2D);
    private final EGLDisplay display = EGL14.eglGetCurrentDisplay();
    private final EGLContext context = EGL14.eglGetCurrentContext();
    private final EGLSurface surface;
    private final int texture;
    private ByteBuffer[] output;
    private int pictures = -1;
    private int sounds = -1;
    private boolean written;
    private long began;

    /** Of a screen of that size. file: where it goes. media: what may be heard, or null. Throws what encoders throw. */
    Recorder(File file, int screenWidth, int screenHeight, Media media) throws IOException {
        this.file = file;
        double scale = Math.min(1, (double) LONGEST / Math.max(screenWidth, screenHeight));
        width = sideOf(scale * screenWidth);
        height = sideOf(scale * screenHeight);
        encoder = MediaCodec.createEncoderByType(TYPE);
        boolean good = false;
        try {
            encoder.configure(format(), null, (MediaCrypto) null, MediaCodec.CONFIGURE_FLAG_ENCODE);
            input = encoder.createInputSurface();
            encoder.start();
            output = encoder.getOutputBuffers();
            muxer = new MediaMuxer(file.getPath(), MediaMuxer.OutputFormat.MUXER_OUTPUT_MPEG_4);
            surface = EGL14.eglCreateWindowSurface(display, config(), input, new int[] {EGL14.EGL_NONE}, 0);
            if (surface == null || surface == EGL14.EGL_NO_SURFACE)
                throw new IOException("the encoder takes no pictures of this screen");
            good = true;
        } finally {
            if (!good) encoder.release();
        }
        texture = VideoCopy.texture(GLES20.GL_TEXTURE_2D, 0, 0);
        sound = Soundtrack.of(media);
    }

    private static int sideOf(double pixels) {
        return Math.max(BLOCK, BLOCK * (int) Math.round(pixels / BLOCK));
    }

    private MediaFormat format() {
        MediaFormat format = MediaFormat.createVideoFormat(TYPE, width, height);
        format.setInteger(MediaFormat.KEY_COLOR_FORMAT, MediaCodecInfo.CodecCapabilities.COLOR_FormatSurface);
        format.setInteger(MediaFormat.KEY_BIT_RATE, (int) (BITS * FRAMES_S * width * height));
        format.setInteger(MediaFormat.KEY_FRAME_RATE, FRAMES_S);
        format.setInteger(MediaFormat.KEY_I_FRAME_INTERVAL, 1);
        return format;
    }

    /** The context's own: another might not fit it. */
    private EGLConfig config() {
        int[] number = new int[1];
        EGLConfig[] found = new EGLConfig[1];
        EGL14.eglQueryContext(display, context, EGL14.EGL_CONFIG_ID, number, 0);
        EGL14.eglChooseConfig(
                display, new int[] {EGL14.EGL_CONFIG_ID, number[0], EGL14.EGL_NONE}, 0, found, 0, 1, number, 0);
        return found[0];
    }

    /** Takes the drawing just made; false: it is long enough. */
    boolean frame(int screenWidth, int screenHeight) {
        long now = SystemClock.elapsedRealtimeNanos();
        if (began == 0) began = now;
        GLES20.glBindTexture(GLES20.GL_TEXTURE_2D, texture);
        GLES20.glCopyTexImage2D(GLES20.GL_TEXTURE_2D, 0, GLES20.GL_RGB, 0, 0, screenWidth, screenHeight, 0);
        EGLSurface screen = EGL14.eglGetCurrentSurface(EGL14.EGL_DRAW);
        EGL14.eglMakeCurrent(display, surface, surface, context);
        copy.paint(texture, AS_IT_IS, width, height);
        EGLExt.eglPresentationTimeANDROID(display, surface, now - began);
        EGL14.eglSwapBuffers(display, surface);
        EGL14.eglMakeCurrent(display, screen, screen, context);
        drain(false);
        if (sounds >= 0) sound.write(muxer, sounds, (now - began) / 1000);
        return (now - began) / 1000 < MOST_US;
    }

    /** What the encoder has for the file; end: all that will come. */
    private void drain(boolean end) {
        for (int tries = end ? TRIES : 1; tries > 0;) {
            int index = encoder.dequeueOutputBuffer(about, end ? WAIT_US : 0);
            if (index == MediaCodec.INFO_TRY_AGAIN_LATER) {
                tries--;
            } else if (index == MediaCodec.INFO_OUTPUT_BUFFERS_CHANGED) {
                output = encoder.getOutputBuffers();
            } else if (index == MediaCodec.INFO_OUTPUT_FORMAT_CHANGED) {
                pictures = muxer.addTrack(encoder.getOutputFormat());
                sounds = sound == null ? -1 : sound.addTo(muxer);
                muxer.start();
            } else if (index >= 0) {
                // The settings are in the format already.
                if ((about.flags & MediaCodec.BUFFER_FLAG_CODEC_CONFIG) == 0 && about.size > 0 && pictures >= 0) {
                    output[index].position(about.offset).limit(about.offset + about.size);
                    muxer.writeSampleData(pictures, output[index], about);
                    written = true;
                }
                encoder.releaseOutputBuffer(index, false);
                if ((about.flags & MediaCodec.BUFFER_FLAG_END_OF_STREAM) != 0) return;
            }
        }
    }

    /** Ends the file; null: there is nothing in it. lost: GL's context went, and the copies with it. */
    File finish(boolean lost) {
        boolean whole = false;
        try {
            encoder.signalEndOfInputStream();
            drain(true);
            if (written) muxer.stop();
            whole = written;
        } finally {
            encoder.release();
            muxer.release();
            input.release();
            if (sound != null) sound.close();
            if (!lost) EGL14.eglDestroySurface(display, surface);
            if (!lost) GLES20.glDeleteTextures(1, new int[] {texture}, 0);
            if (!whole) file.delete();
        }
        return whole ? file : null;
    }
}

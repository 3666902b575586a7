package org.modar;

import android.opengl.GLES20;
import java.nio.ByteBuffer;
import java.nio.ByteOrder;
import java.nio.FloatBuffer;

/**
 * Draws a texture over all of a picture. What MediaPlayer decodes is one of another kind (samplerExternalOES), of which this makes
 * plain ones, which the renderer takes. On GL's thread. The renderer sets its own state anew after Native.share(); the
 * framebuffer stays.
 */
final class VideoCopy {
    /** The target's first row, which GL has at the bottom, is the video's top one. */
    private static final String VERTEX = "attribute vec2 a_at; uniform mat4 u_map; varying vec2 v_at;\n"
            + "void main() {\n  gl_Position = vec4(2.0 * a_at - 1.0, 0.0, 1.0);\n"
            + "  v_at = (u_map * vec4(a_at.x, 1.0 - a_at.y, 0.0, 1.0)).xy;\n}\n";
    private static final String EXTERNAL = "#extension GL_OES_EGL_image_external : require\n";
    private static final String FRAGMENT = "precision mediump float; uniform %s u_video; varying vec2 v_at;\n"
            + "void main() { gl_FragColor = texture2D(u_video, v_at); }\n";

    private final FloatBuffer corners = ByteBuffer.allocateDirect(32).order(ByteOrder.nativeOrder()).asFloatBuffer();
    private final int kind;
    private int program;
    private int buffer;

    /** kind: of the textures that are drawn, GL_TEXTURE_2D or GL_TEXTURE_EXTERNAL_OES. */
    VideoCopy(int kind) {
        this.kind = kind;
        corners.put(new float[] {0, 0, 1, 0, 0, 1, 1, 1}).position(0);
    }

    /** A new context: objects of the old one are gone. */
    void forget() {
        program = 0;
    }

    private void make() {
        program = GLES20.glCreateProgram();
        attach(GLES20.GL_VERTEX_SHADER, VERTEX);
        boolean plain = kind == GLES20.GL_TEXTURE_2D;
        attach(GLES20.GL_FRAGMENT_SHADER,
                (plain ? "" : EXTERNAL) + String.format(FRAGMENT, plain ? "sampler2D" : "samplerExternalOES"));
        GLES20.glBindAttribLocation(program, 0, "a_at");
        GLES20.glLinkProgram(program);
        int[] name = new int[1];
        GLES20.glGenFramebuffers(1, name, 0);
        buffer = name[0];
    }

    private void attach(int kind, String text) {
        int shader = GLES20.glCreateShader(kind);
        GLES20.glShaderSource(shader, text);
        GLES20.glCompileShader(shader);
        GLES20.glAttachShader(program, shader);
        GLES20.glDeleteShader(shader);
    }

    /** A texture for a video's pictures; width 0: whose size comes later. */
    static int texture(int target, int width, int height) {
        int[] name = new int[1];
        GLES20.glGenTextures(1, name, 0);
        GLES20.glBindTexture(target, name[0]);
        if (target == GLES20.GL_TEXTURE_2D && width > 0) {
            GLES20.glTexImage2D(
                    target, 0, GLES20.GL_RGBA, width, height, 0, GLES20.GL_RGBA, GLES20.GL_UNSIGNED_BYTE, null);
        }
        GLES20.glTexParameteri(target, GLES20.GL_TEXTURE_MIN_FILTER, GLES20.GL_LINEAR);
        GLES20.glTexParameteri(target, GLES20.GL_TEXTURE_MAG_FILTER, GLES20.GL_LINEAR);
        GLES20.glTexParameteri(target, GLES20.GL_TEXTURE_WRAP_S, GLES20.GL_CLAMP_TO_EDGE);
        GLES20.glTexParameteri(target, GLES20.GL_TEXTURE_WRAP_T, GLES20.GL_CLAMP_TO_EDGE);
        return name[0];
    }

    /** map: what SurfaceTexture.getTransformMatrix() says of `from`. */
    void draw(int from, float[] map, int to, int width, int height) {
        if (program == 0) make();
        int[] before = new int[1];
        GLES20.glGetIntegerv(GLES20.GL_FRAMEBUFFER_BINDING, before, 0);
        GLES20.glBindFramebuffer(GLES20.GL_FRAMEBUFFER, buffer);
        GLES20.glFramebufferTexture2D(GLES20.GL_FRAMEBUFFER, GLES20.GL_COLOR_ATTACHMENT0, GLES20.GL_TEXTURE_2D, to, 0);
        paint(from, map, width, height);
        GLES20.glBindFramebuffer(GLES20.GL_FRAMEBUFFER, before[0]);
    }

    /** The same into the bound framebuffer. */
    void paint(int from, float[] map, int width, int height) {
        if (program == 0) make();
        GLES20.glViewport(0, 0, width, height);
        GLES20.glDisable(GLES20.GL_BLEND);
        GLES20.glDisable(GLES20.GL_DEPTH_TEST);
        GLES20.glDisable(GLES20.GL_CULL_FACE);
        GLES20.glDisable(GLES20.GL_SCISSOR_TEST);
        GLES20.glColorMask(true, true, true, true);
        GLES20.glUseProgram(program);
        GLES20.glActiveTexture(GLES20.GL_TEXTURE0);
        GLES20.glBindTexture(kind, from);
        GLES20.glUniformMatrix4fv(GLES20.glGetUniformLocation(program, "u_map"), 1, false, map, 0);
        GLES20.glBindBuffer(GLES20.GL_ARRAY_BUFFER, 0);
        GLES20.glEnableVertexAttribArray(0);
        GLES20.glVertexAttribPointer(0, 2, GLES20.GL_FLOAT, false, 0, corners);
        GLES20.glDrawArrays(GLES20.GL_TRIANGLE_STRIP, 0, 4);
        GLES20.glDisableVertexAttribArray(0);
        GLES20.glBindTexture(kind, 0);
    }
}

package org.modar;

import android.opengl.GLSurfaceView;
import javax.microedition.khronos.egl.EGL10;
import javax.microedition.khronos.egl.EGLConfig;
import javax.microedition.khronos.egl.EGLDisplay;

/** A surface with four samples a pixel, so that edges are smooth, and like those of video encoders; without either if none is set. */
final class Samples implements GLSurfaceView.EGLConfigChooser {
    private static final int ES2 = 4; // EGL_OPENGL_ES2_BIT
    private static final int RECORDABLE = 0x3142; // EGL_RECORDABLE_ANDROID

    @Override
    public EGLConfig chooseConfig(EGL10 egl, EGLDisplay display) {
        for (int i = 0; i < 4; i++) {
            int[] wanted = {EGL10.EGL_RENDERABLE_TYPE, ES2, EGL10.EGL_RED_SIZE, 8, EGL10.EGL_GREEN_SIZE, 8,
                    EGL10.EGL_BLUE_SIZE, 8, EGL10.EGL_DEPTH_SIZE, 16, EGL10.EGL_SAMPLES, i < 2 ? 4 : 0,
                    i % 2 == 0 ? RECORDABLE : EGL10.EGL_NONE, 1, EGL10.EGL_NONE};
            EGLConfig[] found = new EGLConfig[1];
            int[] count = new int[1];
            if (egl.eglChooseConfig(display, wanted, found, 1, count) && count[0] > 0) return found[0];
        }
        throw new IllegalArgumentException("no surface for OpenGL ES 2.0");
    }
}

package org.modar;

import android.view.MotionEvent;

/** Pinch: size. Drag with one finger: turn across, shift along. A tap: what was touched. */
final class Fingers {
    interface Listener {
        void moved(float scale, float turn, float x, float y);

        void tapped(float x, float y);
    }

    private static final float MIN_SCALE = 0.2f;
    private static final float MAX_SCALE = 5;
    /** A finger that moves less than this share of the screen taps. */
    private static final float TAP = 0.02f;

    private final Listener listener;
    private float scale = 1;
    private float turn;
    private float shift;
    private float lastX;
    private float lastY;
    private float lastSpread;
    private boolean tap;

    Fingers(Listener listener) {
        this.listener = listener;
    }

    /** Back to how the bundle has it. */
    void reset() {
        scale = 1;
        turn = 0;
        shift = 0;
        listener.moved(scale, turn, 0, shift);
    }

    void touch(MotionEvent event, int width, int height) {
        float x = event.getX();
        float y = event.getY();
        int size = Math.min(width, height);
        switch (event.getActionMasked()) {
            case MotionEvent.ACTION_DOWN:
                tap = true;
                break;
            case MotionEvent.ACTION_POINTER_DOWN:
            case MotionEvent.ACTION_POINTER_UP:
                tap = false;
                lastSpread = 0;
                return;
            case MotionEvent.ACTION_UP:
                if (tap) listener.tapped(x, y);
                return;
            case MotionEvent.ACTION_MOVE:
                if (event.getPointerCount() > 1) {
                    pinch(event);
                    return;
                }
                if (tap && Math.abs(x - lastX) + Math.abs(y - lastY) < TAP * size) return;
                tap = false;
                // Across the screen is half a turn; along it, two patterns.
                turn += (float) Math.PI * (x - lastX) / width;
                shift -= 4 * (y - lastY) / height;
                listener.moved(scale, turn, 0, shift);
                break;
            default:
                return;
        }
        lastX = x;
        lastY = y;
    }

    private void pinch(MotionEvent event) {
        float spread = (float) Math.hypot(event.getX(0) - event.getX(1), event.getY(0) - event.getY(1));
        if (lastSpread > 0) {
            scale = Math.max(MIN_SCALE, Math.min(MAX_SCALE, scale * spread / lastSpread));
            listener.moved(scale, turn, 0, shift);
        }
        lastSpread = spread;
        lastX = event.getX();
        lastY = event.getY();
    }
}

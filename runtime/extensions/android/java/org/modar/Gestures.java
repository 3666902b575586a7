package org.modar;

import android.view.MotionEvent;

/** Touch gestures: a pinch scales; a drag turns (across) and shifts (along); a tap selects. */
final class Gestures {
    static final int NOTHING = 0;
    static final int MOVED = 1;
    static final int TAPPED = 2;

    private static final float MIN_SCALE = 0.2f;
    private static final float MAX_SCALE = 5;
    /** A touch that moves less than this share of the screen is a tap. */
    private static final float TAP = 0.02f;

    /** A factor; radians; half longest sides of the pattern. */
    float scale = 1;
    float turn;
    float shift;
    private float lastX;
    private float lastY;
    private float lastSpread;
    private boolean tap;

    /** Handles an event; returns NOTHING, MOVED or TAPPED. */
    int touch(MotionEvent event, int width, int height) {
        float x = event.getX();
        float y = event.getY();
        int done = NOTHING;
        switch (event.getActionMasked()) {
            case MotionEvent.ACTION_DOWN:
                tap = true;
                break;
            case MotionEvent.ACTION_POINTER_DOWN:
            case MotionEvent.ACTION_POINTER_UP:
                tap = false;
                lastSpread = 0;
                return NOTHING;
            case MotionEvent.ACTION_UP:
                return tap ? TAPPED : NOTHING;
            case MotionEvent.ACTION_MOVE:
                if (event.getPointerCount() > 1) {
                    done = pinch(event);
                    break;
                }
                if (tap && Math.abs(x - lastX) + Math.abs(y - lastY) < TAP * Math.min(width, height)) return NOTHING;
                tap = false;
                // Across the screen is half a turn; along it, two patterns.
                turn += (float) Math.PI * (x - lastX) / width;
                shift -= 4 * (y - lastY) / height;
                done = MOVED;
                break;
            default:
                return NOTHING;
        }
        lastX = x;
        lastY = y;
        return done;
    }

    private int pinch(MotionEvent event) {
        float before = lastSpread;
        lastSpread = (float) Math.hypot(event.getX(0) - event.getX(1), event.getY(0) - event.getY(1));
        if (before <= 0) return NOTHING;
        scale = Math.max(MIN_SCALE, Math.min(MAX_SCALE, scale * lastSpread / before));
        return MOVED;
    }
}

package org.modar;

import android.content.Context;
import android.graphics.Bitmap;
import android.graphics.Canvas;
import android.graphics.Paint;
import android.graphics.Rect;
import android.graphics.RectF;
import android.view.KeyEvent;
import android.view.MotionEvent;
import android.view.View;

/** A photo with four corners, which fingers drag; keys move one after the other, and a click chooses the next. */
final class Corners extends View {
    /** Where corners are at first that were not found, as shares of the photo's sides: people leave a margin. As on the page. */
    private static final float MARGIN = 0.1f;
    private static final float STEP = 2;
    private static final float LARGE_STEP = 16;
    private static final int INK = 0xFFFFFFFF;
    private static final int CHOSEN = 0xFFFFB020;

    /** x and y clockwise from the top left, pixels of the photo. */
    final float[] at = new float[8];
    private final Paint paint = new Paint();
    private final RectF place = new RectF();
    private final Words words;
    private Bitmap photo;
    private int chosen;

    Corners(Context context, Words words) {
        super(context);
        this.words = words;
        setFocusable(true);
    }

    /** null: none any more. */
    void show(Bitmap taken) {
        photo = taken;
        if (taken == null) return;
        int[] pixels = pixels();
        boolean found = false;
        try {
            found = Native.photoCorners(pixels, taken.getWidth(), taken.getHeight(), at);
        } catch (ModarException tooSmall) {
            found = false;
        }
        for (int i = 0; i < 8 && !found; i++) {
            boolean far = i % 2 == 0 ? i == 2 || i == 4 : i > 4;
            at[i] = (far ? 1 - MARGIN : MARGIN) * (i % 2 == 0 ? taken.getWidth() : taken.getHeight());
        }
        choose(0);
    }

    Bitmap photo() {
        return photo;
    }

    /** As Bitmap.getPixels() gives them. */
    int[] pixels() {
        int[] pixels = new int[photo.getWidth() * photo.getHeight()];
        photo.getPixels(pixels, 0, photo.getWidth(), 0, 0, photo.getWidth(), photo.getHeight());
        return pixels;
    }

    private void choose(int corner) {
        chosen = corner;
        String name = words.get("own-corner", corner + 1);
        setContentDescription(name);
        announceForAccessibility(name);
        invalidate();
    }

    private void move(float x, float y) {
        at[2 * chosen] = Math.max(0, Math.min(photo.getWidth(), x));
        at[2 * chosen + 1] = Math.max(0, Math.min(photo.getHeight(), y));
        invalidate();
    }

    /** Pixels of the screen for one of the photo; and the place of the photo. */
    private float scale() {
        float scale = Math.min((float) getWidth() / photo.getWidth(), (float) getHeight() / photo.getHeight());
        float left = (getWidth() - scale * photo.getWidth()) / 2;
        float top = (getHeight() - scale * photo.getHeight()) / 2;
        place.set(left, top, left + scale * photo.getWidth(), top + scale * photo.getHeight());
        return scale;
    }

    @Override
    protected void onDraw(Canvas canvas) {
        if (photo == null) return;
        float scale = scale();
        paint.setStrokeWidth(getWidth() / 100f);
        canvas.drawBitmap(photo, (Rect) null, place, paint);
        for (int i = 0; i < 4; i++) {
            float x = place.left + scale * at[2 * i];
            float y = place.top + scale * at[2 * i + 1];
            int next = (i + 1) % 4;
            paint.setColor(INK);
            canvas.drawLine(x, y, place.left + scale * at[2 * next], place.top + scale * at[2 * next + 1], paint);
            if (i == chosen) paint.setColor(CHOSEN);
            canvas.drawCircle(x, y, getWidth() / 40f, paint);
        }
    }

    @Override
    public boolean onTouchEvent(MotionEvent event) {
        if (photo == null) return false;
        float scale = scale();
        float x = (event.getX() - place.left) / scale;
        float y = (event.getY() - place.top) / scale;
        if (event.getActionMasked() == MotionEvent.ACTION_DOWN) {
            int nearest = 0;
            for (int i = 1; i < 4; i++) {
                if (Math.hypot(x - at[2 * i], y - at[2 * i + 1])
                        < Math.hypot(x - at[2 * nearest], y - at[2 * nearest + 1]))
                    nearest = i;
            }
            choose(nearest);
        } else if (event.getActionMasked() == MotionEvent.ACTION_MOVE) {
            move(x, y);
        }
        return true;
    }

    @Override
    public boolean performClick() {
        choose((chosen + 1) % 4);
        return super.performClick();
    }

    @Override
    public boolean onKeyDown(int key, KeyEvent event) {
        float by = event.isShiftPressed() ? LARGE_STEP : STEP;
        float x = at[2 * chosen];
        float y = at[2 * chosen + 1];
        switch (key) {
            case KeyEvent.KEYCODE_DPAD_LEFT:
                move(x - by, y);
                return true;
            case KeyEvent.KEYCODE_DPAD_RIGHT:
                move(x + by, y);
                return true;
            case KeyEvent.KEYCODE_DPAD_UP:
                move(x, y - by);
                return true;
            case KeyEvent.KEYCODE_DPAD_DOWN:
                move(x, y + by);
                return true;
            case KeyEvent.KEYCODE_DPAD_CENTER:
            case KeyEvent.KEYCODE_ENTER:
                return performClick();
            default:
                return super.onKeyDown(key, event);
        }
    }
}

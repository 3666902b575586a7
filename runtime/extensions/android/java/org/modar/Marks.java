package org.modar;

import android.content.Context;
import android.content.res.Resources;
import android.util.DisplayMetrics;
import android.view.View;
import android.view.ViewGroup;
import android.widget.Button;
import java.util.ArrayList;
import java.util.List;

/**
 * The marks of labels that point: a button each over GL's picture, of constant size, faded where something covers the
 * point. A screen reader reads them in the bundle's order. Of one bundle; for the main thread, but for look().
 */
final class Marks {
    /** What fingers need, of which the drawing takes two thirds; density-independent pixels. */
    private static final int SIDE = 48;
    /** As on the page: covered marks are there, with little contrast. */
    private static final float FADED = 0.35f;
    /** Drawings between looks at whether a label is covered, one label a look: each reads a model's triangles. As on the page. */
    private static final int LOOK_EVERY = 6;
    private static final int INK = 0xFF000000;

    private static final class Mark {
        final int node;
        final Button button;
        boolean seen;
        /** x, y and whether it is covered, as Native.label() says. */
        final float[] place = new float[3];

        Mark(int node, Button button) {
            this.node = node;
            this.button = button;
        }
    }

    private final long session;
    private final float side;
    private final List<Mark> marks = new ArrayList<>();
    private final float[] found = new float[3];
    private int drawings;

    /** screen: takes the buttons, which have the node as their tag, and gives up those that it has. language: null: any. */
    Marks(Context context, ViewGroup screen, View.OnClickListener touched, long session, String language)
            throws ModarException {
        this.session = session;
        Resources resources = context.getResources();
        DisplayMetrics metrics = resources.getDisplayMetrics();
        side = SIDE * metrics.density;
        screen.removeAllViews();
        int[] about = Native.node(session, 0);
        for (int i = 0; about != null; about = Native.node(session, ++i)) {
            if (about[Native.KIND] != Native.LABEL) continue;
            String title = language == null ? null : Native.nodeText(session, i, true, language);
            String word = Native.mark(session, i);
            Button button = new Button(context);
            button.setText(word);
            button.setContentDescription(title == null ? word : word + ": " + title);
            button.setTextColor(INK);
            button.setPadding(0, 0, 0, 0);
            button.setBackgroundResource(R.drawable.mark);
            button.setTag(i);
            button.setOnClickListener(touched);
            button.setVisibility(View.GONE);
            screen.addView(button, new ViewGroup.LayoutParams((int) side, (int) side));
            marks.add(new Mark(i, button));
        }
    }

    boolean isEmpty() {
        return marks.isEmpty();
    }

    /** On GL's thread, after a drawing: where the labels are in it. */
    synchronized void look() throws ModarException {
        int looked = drawings % LOOK_EVERY == 0 ? drawings / LOOK_EVERY % marks.size() : -1;
        drawings++;
        for (int i = 0; i < marks.size(); i++) {
            Mark mark = marks.get(i);
            mark.seen = Native.label(session, mark.node, i == looked, found);
            if (!mark.seen) continue;
            mark.place[0] = found[0];
            mark.place[1] = found[1];
            if (i == looked) mark.place[2] = found[2];
        }
    }

    /** Lays the buttons where look() saw the labels. */
    synchronized void follow() {
        for (Mark mark : marks) {
            mark.button.setVisibility(mark.seen ? View.VISIBLE : View.GONE);
            if (!mark.seen) continue;
            mark.button.setX(mark.place[0] - side / 2);
            mark.button.setY(mark.place[1] - side / 2);
            mark.button.setAlpha(mark.place[2] != 0 ? FADED : 1);
        }
    }
}

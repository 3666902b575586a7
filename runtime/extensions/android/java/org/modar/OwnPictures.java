package org.modar;

import android.content.ContentResolver;
import android.content.Context;
import android.graphics.Bitmap;
import android.graphics.BitmapFactory;
import android.graphics.Matrix;
import android.media.ExifInterface;
import android.net.Uri;
import java.io.File;
import java.io.FileInputStream;
import java.io.FileOutputStream;
import java.io.IOException;
import java.util.ArrayList;
import java.util.Arrays;
import java.util.List;

/** The visitor's own pictures with models on them: what they are recognised by is kept in the app's own folder, and nothing else. */
final class OwnPictures {
    /** A photo with its corners, to be made one. */
    static final class Photo {
        final int[] pixels;
        final int width;
        final int height;
        final float[] corners;
        final int scene;
        /** What it is recognised by, once it is made. */
        byte[] record;

        Photo(int[] pixels, int width, int height, float[] corners, int scene) {
            this.pixels = pixels;
            this.width = width;
            this.height = height;
            this.corners = corners;
            this.scene = scene;
        }

        void make() throws ModarException {
            record = Native.photoRecord(pixels, width, height, corners);
        }
    }

    /** Of the longer side of photos that are worked on, pixels: as on the page. */
    private static final int SIDE = 1024;
    /** Degrees by EXIF's orientation, after the mirror. */
    private static final int[] CLOCKWISE = {0, 0, 0, 180, 180, 270, 90, 90, 270};

    private final ContentResolver content;
    private final File folder;
    /** For what Android reads from files alone. */
    private final File cache;

    OwnPictures(Context context) {
        content = context.getContentResolver();
        folder = new File(context.getFilesDir(), "own");
        cache = context.getCacheDir();
    }

    /** Names are TIME-SCENE. */
    private String[] kept() {
        String[] names = folder.list();
        if (names == null) return new String[0];
        Arrays.sort(names);
        return names;
    }

    boolean isEmpty() {
        return kept().length == 0;
    }

    /** Those of earlier visits, for a session that has no camera yet; answers how many there are of the `scenes` that it has. */
    int addTo(long session) throws ModarException {
        int count = 0;
        for (String name : kept()) {
            try {
                byte[] record = Bundles.bytes(new FileInputStream(new File(folder, name)));
                Native.addPattern(session, record, Integer.parseInt(name.substring(name.indexOf('-') + 1)));
                count++;
            } catch (IOException | ModarException torn) { // or of a bundle with fewer scenes, or an old version
                continue;
            }
        }
        return count;
    }

    void keep(Photo made) throws IOException {
        folder.mkdirs();
        File file = new File(folder, System.currentTimeMillis() + "-" + made.scene);
        boolean whole = false;
        try {
            FileOutputStream out = new FileOutputStream(file);
            try {
                out.write(made.record);
                out.getFD().sync();
                whole = true;
            } finally {
                out.close();
            }
        } finally {
            if (!whole) file.delete();
        }
    }

    void forget() {
        for (String name : kept()) new File(folder, name).delete();
    }

    /** The names of the models of a session's scenes, in their order. */
    static List<String> models(long session) throws ModarException {
        List<String> names = new ArrayList<>();
        for (int model = Native.sceneModel(session, 0); model >= 0; model = Native.sceneModel(session, names.size())) {
            names.add(Native.modelName(session, model));
        }
        return names;
    }

    /** A picture that another app handed over. */
    Bitmap read(Uri address) throws IOException {
        byte[] file = Bundles.bytes(content.openInputStream(address));
        BitmapFactory.Options how = new BitmapFactory.Options();
        how.inJustDecodeBounds = true;
        BitmapFactory.decodeByteArray(file, 0, file.length, how);
        how.inJustDecodeBounds = false;
        how.inSampleSize = 1;
        while (Math.max(how.outWidth, how.outHeight) / (2 * how.inSampleSize) >= SIDE) how.inSampleSize *= 2;
        Bitmap read = BitmapFactory.decodeByteArray(file, 0, file.length, how);
        if (read == null) throw new IOException("it is no picture");
        return upright(small(read), orientation(file));
    }

    /** By the file's EXIF; 1 where it says nothing. */
    private int orientation(byte[] picture) throws IOException {
        File file = File.createTempFile("photo", null, cache);
        try {
            FileOutputStream out = new FileOutputStream(file);
            try {
                out.write(picture);
            } finally {
                out.close();
            }
            return new ExifInterface(file.getPath())
                    .getAttributeInt(ExifInterface.TAG_ORIENTATION, ExifInterface.ORIENTATION_NORMAL);
        } finally {
            file.delete();
        }
    }

    private static Bitmap upright(Bitmap stored, int orientation) {
        if (orientation < ExifInterface.ORIENTATION_FLIP_HORIZONTAL
                || orientation > ExifInterface.ORIENTATION_ROTATE_270)
            return stored;
        boolean mirrored = orientation == ExifInterface.ORIENTATION_FLIP_HORIZONTAL
                || orientation == ExifInterface.ORIENTATION_FLIP_VERTICAL
                || orientation == ExifInterface.ORIENTATION_TRANSPOSE
                || orientation == ExifInterface.ORIENTATION_TRANSVERSE;
        Matrix turn = new Matrix();
        turn.setScale(mirrored ? -1 : 1, 1);
        turn.postRotate(CLOCKWISE[orientation]);
        return Bitmap.createBitmap(stored, 0, 0, stored.getWidth(), stored.getHeight(), turn, true);
    }

    static Bitmap small(Bitmap large) {
        float scale = (float) SIDE / Math.max(large.getWidth(), large.getHeight());
        if (scale >= 1) return large;
        return Bitmap.createScaledBitmap(large, Math.max(1, Math.round(scale * large.getWidth())),
                Math.max(1, Math.round(scale * large.getHeight())), true);
    }
}

package org.modar;

import android.annotation.TargetApi;
import android.content.ContentResolver;
import android.content.ContentValues;
import android.content.Context;
import android.content.Intent;
import android.graphics.Bitmap;
import android.media.MediaScannerConnection;
import android.net.Uri;
import android.os.Build;
import android.os.Environment;
import android.provider.MediaStore;
import android.provider.MediaStore.Images;
import android.provider.MediaStore.Video;
import java.io.File;
import java.io.FileInputStream;
import java.io.FileOutputStream;
import java.io.IOException;
import java.io.OutputStream;

/** Photos and videos that a visitor takes, where galleries show them. Each way needs no permission that the phone would ask for. */
final class Photos implements MediaScannerConnection.OnScanCompletedListener {
    private static final String PHOTO = "image/jpeg";
    private static final String VIDEO = "video/mp4";
    /** Of 100: no blocks are seen on edges of models. */
    private static final int QUALITY = 92;
    private final Context context;
    private final String album;
    /** The newest one, for other apps; null: none yet. */
    volatile Uri newest;
    private volatile String newestType;

    /** album: the app's name. */
    Photos(Context context, String album) {
        this.context = context;
        this.album = album;
    }

    /** what: a Bitmap, or the File of a video. On any thread but the main one. Throws where the storage is full; nothing half-written stays. */
    void save(Object what) throws IOException {
        boolean photo = what instanceof Bitmap;
        String name = (photo ? "picture-" : "video-") + System.currentTimeMillis() + (photo ? ".jpg" : ".mp4");
        String type = photo ? PHOTO : VIDEO;
        String folder = photo ? Environment.DIRECTORY_PICTURES : Environment.DIRECTORY_MOVIES;
        if (Build.VERSION.SDK_INT >= 29) {
            insert(name, type, folder, what);
        } else {
            write(new File(folder(folder), name), type, what);
        }
        newestType = type;
    }

    private static boolean put(Object what, OutputStream out) throws IOException {
        if (what instanceof Bitmap) return ((Bitmap) what).compress(Bitmap.CompressFormat.JPEG, QUALITY, out);
        Bundles.copy(new FileInputStream((File) what), out);
        return true;
    }

    /** Android 10 and later: the media store writes. */
    @TargetApi(29)
    private void insert(String name, String type, String folder, Object what) throws IOException {
        ContentResolver store = context.getContentResolver();
        ContentValues values = new ContentValues();
        values.put(MediaStore.MediaColumns.DISPLAY_NAME, name);
        values.put(MediaStore.MediaColumns.MIME_TYPE, type);
        values.put(MediaStore.MediaColumns.RELATIVE_PATH, folder + "/" + album);
        values.put(MediaStore.MediaColumns.IS_PENDING, 1);
        Uri uri = store.insert(
                type == PHOTO ? Images.Media.EXTERNAL_CONTENT_URI : Video.Media.EXTERNAL_CONTENT_URI, values);
        if (uri == null) throw new IOException("the gallery takes no " + type);
        boolean whole = false;
        try {
            OutputStream out = store.openOutputStream(uri);
            if (out == null) throw new IOException("the gallery takes no " + type);
            try {
                whole = put(what, out);
            } finally {
                out.close();
            }
        } finally {
            if (!whole) store.delete(uri, null, null);
        }
        if (!whole) throw new IOException("no space is left");
        values.clear();
        values.put(MediaStore.MediaColumns.IS_PENDING, 0);
        store.update(uri, values, null, null);
        newest = uri;
    }

    /** Android 5 to 9: a folder of the app's that galleries look into. Before: the phone's own folder, by a permission that is given. */
    private File folder(String kind) {
        File folder = null;
        if (Build.VERSION.SDK_INT >= 21) {
            for (File each : context.getExternalMediaDirs()) {
                if (folder == null) folder = each;
            }
        } else {
            folder = new File(Environment.getExternalStoragePublicDirectory(kind), album);
        }
        return folder != null && (folder.isDirectory() || folder.mkdirs()) ? folder : context.getExternalFilesDir(null);
    }

    private void write(File file, String type, Object what) throws IOException {
        boolean whole = false;
        try {
            FileOutputStream out = new FileOutputStream(file);
            try {
                whole = put(what, out);
                out.getFD().sync();
            } finally {
                out.close();
            }
        } finally {
            if (!whole) file.delete();
        }
        if (!whole) throw new IOException("no space is left");
        MediaScannerConnection.scanFile(context, new String[] {file.getPath()}, new String[] {type}, this);
    }

    @Override
    public void onScanCompleted(String path, Uri uri) {
        newest = uri;
    }

    /** What to start to let the visitor choose an app for the newest one. */
    Intent share() {
        Intent send = new Intent(Intent.ACTION_SEND);
        send.setType(newestType);
        send.putExtra(Intent.EXTRA_STREAM, newest);
        send.addFlags(Intent.FLAG_GRANT_READ_URI_PERMISSION);
        return Intent.createChooser(send, null);
    }
}

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
import java.io.File;
import java.io.FileOutputStream;
import java.io.IOException;
import java.io.OutputStream;

/** Photos that a visitor takes, where galleries show them. Each way needs no permission that the phone would ask for. */
final class Photos implements MediaScannerConnection.OnScanCompletedListener {
    private static final String TYPE = "image/jpeg";
    /** Of 100: no blocks are seen on edges of models. */
    private static final int QUALITY = 92;
    private final Context context;
    private final String album;
    /** The newest one, for other apps; null: none yet. */
    volatile Uri newest;

    /** album: the app's name. */
    Photos(Context context, String album) {
        this.context = context;
        this.album = album;
    }

    /** On any thread but the main one. Throws where the storage is full; nothing half-written stays. */
    void save(Bitmap bitmap) throws IOException {
        String name = "picture-" + System.currentTimeMillis() + ".jpg";
        if (Build.VERSION.SDK_INT >= 29) {
            insert(name, bitmap);
        } else {
            write(new File(folder(), name), bitmap);
        }
    }

    /** Android 10 and later: the media store writes. */
    @TargetApi(29)
    private void insert(String name, Bitmap bitmap) throws IOException {
        ContentResolver store = context.getContentResolver();
        ContentValues values = new ContentValues();
        values.put(MediaStore.MediaColumns.DISPLAY_NAME, name);
        values.put(MediaStore.MediaColumns.MIME_TYPE, TYPE);
        values.put(MediaStore.MediaColumns.RELATIVE_PATH, Environment.DIRECTORY_PICTURES + "/" + album);
        values.put(MediaStore.MediaColumns.IS_PENDING, 1);
        Uri uri = store.insert(Images.Media.EXTERNAL_CONTENT_URI, values);
        if (uri == null) throw new IOException("the gallery takes no picture");
        boolean whole = false;
        try {
            OutputStream out = store.openOutputStream(uri);
            if (out == null) throw new IOException("the gallery takes no picture");
            try {
                whole = bitmap.compress(Bitmap.CompressFormat.JPEG, QUALITY, out);
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

    /** Android 5 to 9: a folder of the app's that galleries look into. Before: the phone's pictures, by a permission that is given. */
    private File folder() {
        File folder = null;
        if (Build.VERSION.SDK_INT >= 21) {
            for (File each : context.getExternalMediaDirs()) {
                if (folder == null) folder = each;
            }
        } else {
            folder = new File(Environment.getExternalStoragePublicDirectory(Environment.DIRECTORY_PICTURES), album);
        }
        return folder != null && (folder.isDirectory() || folder.mkdirs()) ? folder : context.getExternalFilesDir(null);
    }

    private void write(File file, Bitmap bitmap) throws IOException {
        boolean whole = false;
        try {
            FileOutputStream out = new FileOutputStream(file);
            try {
                whole = bitmap.compress(Bitmap.CompressFormat.JPEG, QUALITY, out);
                out.getFD().sync();
            } finally {
                out.close();
            }
        } finally {
            if (!whole) file.delete();
        }
        if (!whole) throw new IOException("no space is left");
        MediaScannerConnection.scanFile(context, new String[] {file.getPath()}, new String[] {TYPE}, this);
    }

    @Override
    public void onScanCompleted(String path, Uri uri) {
        newest = uri;
    }

    /** What to start to let the visitor choose an app for the newest photo. */
    Intent share() {
        Intent send = new Intent(Intent.ACTION_SEND);
        send.setType(TYPE);
        send.putExtra(Intent.EXTRA_STREAM, newest);
        send.addFlags(Intent.FLAG_GRANT_READ_URI_PERMISSION);
        return Intent.createChooser(send, null);
    }
}

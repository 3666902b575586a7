package org.modar;

import android.content.Context;
import android.content.res.AssetFileDescriptor;
import android.graphics.Bitmap;
import android.graphics.BitmapFactory;
import android.net.Uri;
import android.os.ParcelFileDescriptor;
import java.io.ByteArrayOutputStream;
import java.io.File;
import java.io.FileInputStream;
import java.io.FileOutputStream;
import java.io.IOException;
import java.io.InputStream;
import java.io.OutputStream;
import java.io.StringReader;
import java.util.ArrayList;
import java.util.Arrays;
import java.util.List;
import java.util.Properties;

/**
 * Where bundles come from: the release that was fetched, the app's folder, the APK, in this order.
 * One of the same name replaces another that is damaged. Without one, the preview of a release that
 * is being downloaded.
 */
final class Bundles {
    /** A bundle: a file, or an asset of the APK. */
    static final class Source {
        final String name;
        final File file;
        final String origin;
        /** While it is shown. */
        long session;
        /** What verifying found; null: nothing. */
        volatile String damage;

        Source(String name, File file, String origin) {
            this.name = name;
            this.file = file;
            this.origin = origin;
        }
    }

    private static final String ENDING = ".modar";
    private static final String ASSETS = "bundles";
    /** Bytes: then the list of verified bundles begins anew. */
    private static final int MOST_STAMPS = 10000;
    private final Context context;
    /** What adb and file managers reach; the app needs no permission for it. */
    final File folder;
    final File store;
    private final File verified;
    private final File focal;

    Bundles(Context context) {
        this.context = context;
        File outside = context.getExternalFilesDir(null);
        folder = outside != null ? outside : context.getFilesDir();
        store = new File(context.getFilesDir(), "store");
        verified = new File(context.getFilesDir(), "verified");
        focal = new File(context.getFilesDir(), "focal");
    }

    List<Source> list() {
        List<Source> all = new ArrayList<>();
        if (Fetch.AVAILABLE) {
            for (String path : Fetch.installed(store.getPath())) {
                all.add(new Source(nameOf(path), new File(path), "release"));
            }
        }
        String[] files = folder.list();
        for (String file : sorted(files)) all.add(new Source(nameOf(file), new File(folder, file), "folder"));
        try {
            for (String asset : sorted(context.getAssets().list(ASSETS)))
                all.add(new Source(nameOf(asset), null, "app"));
        } catch (IOException none) {
            // an APK without assets
        }
        if (all.isEmpty() && Fetch.AVAILABLE) {
            for (String path : Fetch.first(store.getPath()))
                all.add(new Source(nameOf(path), new File(path), "preview"));
        }
        return all;
    }

    private static List<String> sorted(String[] names) {
        List<String> bundles = new ArrayList<>();
        if (names == null) return bundles;
        Arrays.sort(names);
        for (String name : names) {
            if (name.endsWith(ENDING)) bundles.add(name);
        }
        return bundles;
    }

    private static String nameOf(String path) {
        String file = new File(path).getName();
        int dot = file.lastIndexOf('.');
        return dot > 0 ? file.substring(0, dot) : file;
    }

    /** Maps it: an asset through the APK's own descriptor, at its offset. */
    long open(Source source) throws ModarException {
        if (source.file != null) return Native.openFile(source.file.getPath());
        String asset = ASSETS + "/" + source.name + ENDING;
        try {
            AssetFileDescriptor descriptor = context.getAssets().openFd(asset);
            try {
                ParcelFileDescriptor apk = descriptor.getParcelFileDescriptor();
                return Native.openFd(apk.getFd(), descriptor.getStartOffset(), descriptor.getLength());
            } finally {
                descriptor.close();
            }
        } catch (IOException compressed) {
            throw new ModarException(2, "android.asset", asset,
                    "it cannot be opened in the APK: " + compressed.getMessage(),
                    "make the APK with scripts/apk.sh, which stores bundles uncompressed");
        }
    }

    /** Copies what another app hands over into the app's folder, if it is a bundle. */
    File add(Uri from) throws IOException, ModarException {
        String name = String.valueOf(from.getLastPathSegment());
        name = nameOf(name.substring(Math.max(name.lastIndexOf('/'), name.lastIndexOf(':')) + 1));
        File part = new File(folder, name + ".part");
        try {
            FileOutputStream out = new FileOutputStream(part);
            try {
                copy(context.getContentResolver().openInputStream(from), out);
                out.getFD().sync();
            } finally {
                out.close();
            }
            long opened = Native.openFile(part.getPath());
            try {
                Native.verify(opened);
            } finally {
                Native.close(opened);
            }
            File added = new File(folder, name + ENDING);
            if (!part.renameTo(added)) throw new IOException(added.getPath());
            return added;
        } finally {
            part.delete();
        }
    }

    /** A picture of the print, NAME.png or NAME.jpg next to the bundle, or null. */
    Bitmap hint(Source source) {
        for (String ending : new String[] {".png", ".jpg"}) {
            try {
                byte[] file = bytes(beside(source, ending));
                return BitmapFactory.decodeByteArray(file, 0, file.length);
            } catch (IOException none) {
                continue;
            }
        }
        return null;
    }

    /** Texts for visitors, NAME.properties next to the bundle: a line "pattern=text" or "model=text" each. */
    Properties texts(Source source) {
        Properties texts = new Properties();
        try {
            texts.load(new StringReader(text(beside(source, ".properties"))));
        } catch (IOException none) {
            return texts;
        }
        return texts;
    }

    /** What changes when the bundle does: its own file, or the APK that contains it. */
    private static String stamp(File file) {
        return file.getPath() + " " + file.length() + " " + file.lastModified() + "\n";
    }

    private String stampOf(Source source) {
        return source.name + " " + stamp(source.file != null ? source.file : new File(context.getPackageCodePath()));
    }

    /** Whether every byte of it has been checked since it came. */
    boolean isVerified(Source source) {
        try {
            return text(new FileInputStream(verified)).contains(stampOf(source));
        } catch (IOException none) {
            return false;
        }
    }

    /** On any thread. A phone whose storage is full checks again next time. */
    synchronized void setVerified(Source source) throws IOException {
        write(verified, stampOf(source), verified.length() < MOST_STAMPS);
    }

    private InputStream beside(Source source, String ending) throws IOException {
        if (source.file == null) return context.getAssets().open(ASSETS + "/" + source.name + ending);
        File own = new File(source.file.getParentFile(), source.name + ending);
        return new FileInputStream(own.exists() ? own : new File(folder, source.name + ending));
    }

    /** What `modar calibrate` wrote for this phone, or null. */
    String lens() {
        File file = new File(folder, "camera.yml");
        return file.exists() ? file.getPath() : null;
    }

    /** What Native.focal() said when the app was last used; 0: unknown. */
    double focal() {
        try {
            return Double.parseDouble(text(new FileInputStream(focal)));
        } catch (IOException | NumberFormatException none) {
            return 0;
        }
    }

    void setFocal(double share) throws IOException {
        write(focal, Double.toString(share), false);
    }

    String asset(String name) throws IOException {
        return text(context.getAssets().open(name)).trim();
    }

    /** All of a file, which is closed. */
    static byte[] bytes(InputStream in) throws IOException {
        ByteArrayOutputStream all = new ByteArrayOutputStream();
        copy(in, all);
        return all.toByteArray();
    }

    /** Closes `in` alone. */
    static void copy(InputStream in, OutputStream out) throws IOException {
        try {
            byte[] part = new byte[1 << 12];
            for (int got = in.read(part); got > 0; got = in.read(part)) out.write(part, 0, got);
        } finally {
            in.close();
        }
    }

    static String text(InputStream in) throws IOException {
        return new String(bytes(in), "UTF-8");
    }

    static void write(File file, String text, boolean append) throws IOException {
        FileOutputStream out = new FileOutputStream(file, append);
        try {
            out.write(text.getBytes("UTF-8"));
        } finally {
            out.close();
        }
    }
}

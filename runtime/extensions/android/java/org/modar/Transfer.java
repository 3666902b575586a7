package org.modar;

import java.io.FileInputStream;
import java.io.FileNotFoundException;
import java.io.IOException;
import java.io.InputStream;
import java.net.HttpURLConnection;
import java.net.URL;

/** One file of a release at a time, by the phone's own HTTP: its certificates, its proxy. Called by Fetch's thread. */
abstract class Transfer {
    private static final int TIMEOUT_MS = 30000;
    private final String base;
    private final byte[] part = new byte[1 << 15];
    private InputStream stream;

    Transfer(String base) {
        this.base = base.endsWith("/") ? base : base + "/";
    }

    /** 0: opened from byte `from`; 1: there is no such file; 2: try again. */
    final int open(String path, long from) {
        close();
        try {
            if (base.startsWith("/")) { // a stick's folder
                stream = new FileInputStream(base + path);
                skip(from);
                return 0;
            }
            HttpURLConnection connection = (HttpURLConnection) new URL(base + path).openConnection();
            connection.setConnectTimeout(TIMEOUT_MS);
            connection.setReadTimeout(TIMEOUT_MS);
            if (from > 0) connection.setRequestProperty("Range", "bytes=" + from + "-");
            int status = connection.getResponseCode();
            if (status == 404 || status == 410) return 1;
            if (status != 200 && status != 206) return 2;
            stream = connection.getInputStream();
            if (from > 0 && status == 200) skip(from); // a server without ranges
            return 0;
        } catch (FileNotFoundException none) {
            return 1;
        } catch (IOException failed) {
            return 2;
        }
    }

    private void skip(long bytes) throws IOException {
        while (bytes > 0) {
            int got = stream.read(part, 0, (int) Math.min(bytes, part.length));
            if (got <= 0) throw new IOException("the file ends early");
            bytes -= got;
        }
    }

    /** Bytes now in buffer(); 0 at the end, -1 where the connection broke. */
    final int read() {
        try {
            return Math.max(0, stream.read(part));
        } catch (IOException broken) {
            return -1;
        }
    }

    final byte[] buffer() {
        return part;
    }

    final void close() {
        try {
            if (stream != null) stream.close();
        } catch (IOException closed) {
            // nothing is lost: the bytes that came are checked by their hash
        }
        stream = null;
    }

    /** What Fetch.first() names can be shown; the rest of the release is yet to come. */
    abstract void first();

    /** Bytes of the release so far. */
    abstract void progress(long done, long total);
}

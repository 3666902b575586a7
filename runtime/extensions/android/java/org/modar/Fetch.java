package org.modar;

/** libmodar_fetch_jni.so: the installer of releases (modar/fetch.hpp). An APK without network lacks it. */
public final class Fetch {
    static final boolean AVAILABLE = load();

    private Fetch() {}

    private static boolean load() {
        try {
            System.loadLibrary("modar_fetch_jni");
            return true;
        } catch (UnsatisfiedLinkError none) {
            return false;
        }
    }

    /**
     * Updates the store to the newest release, or throws and leaves the installed one in use.
     * Downloaded files stay for the next try.
     *
     * @param url for messages; `transfer` downloads the files
     * @param key text of the publisher's public key
     * @return whether something new was installed
     */
    static native boolean fetch(String url, String store, String key, Transfer transfer) throws ModarException;

    /** Paths of the bundles of the release in use; none where there is no release. */
    static native String[] installed(String store);

    /** Paths of what can be shown of bundles that are not installed, until a fetch installs them: NAME.first. */
    static native String[] first(String store);

    /** "7", or "none". */
    static native String version(String store);

    /** Checks the installed release, and goes back to the release before if it is damaged: then true. */
    static native boolean verify(String store) throws ModarException;
}

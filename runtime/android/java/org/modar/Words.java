package org.modar;

import android.content.res.AssetManager;
import java.io.IOException;
import java.io.InputStream;
import java.io.InputStreamReader;
import java.util.Properties;

/** What the screen says. An asset words.properties (UTF-8) says it in another language. */
final class Words {
    private static final String[] ENGLISH = {
        "look", "Point the camera at: %s",
        "far", "Come closer, and let the whole picture into view",
        "blur", "Hold the phone still",
        "edge", "Let the whole picture into view",
        "nothing", "Nothing found yet: more light, and straight towards the picture",
        "permission", "This app shows models on the camera's picture. Allow the camera, and touch the screen",
        "camera", "The camera does not answer: %s",
        "bundle", "The models cannot be read: %s",
        "empty", "There is nothing to show: copy a bundle to %s",
        "gl", "This phone cannot draw the models: %s",
        "space", "The picture was not saved: %s",
        "saved", "Saved: %s",
        "fetching", "Update: %d of %d kB",
        "current", "What is installed is the newest",
        "updated", "Updated",
        "not-updated", "No update: %s",
        "picture", "Picture", "models", "Next", "update", "Update", "about", "Info",
    };
    private final Properties words = new Properties();

    Words(AssetManager assets) {
        for (int i = 0; i < ENGLISH.length; i += 2) words.setProperty(ENGLISH[i], ENGLISH[i + 1]);
        try {
            InputStream own = assets.open("words.properties");
            try {
                words.load(new InputStreamReader(own, "UTF-8"));
            } finally {
                own.close();
            }
        } catch (IOException none) {
            return; // English it is
        }
    }

    String get(String key, Object... values) {
        return String.format(words.getProperty(key, key), values);
    }

    /** Advice for the tracker's reason. */
    String advice(String reason) {
        if (reason == null) return get("nothing");
        if (reason.contains("blur")) return get("blur");
        if (reason.contains("edge") || reason.contains("border")) return get("edge");
        if (reason.contains("small") || reason.contains("few")) return get("far");
        return get("nothing");
    }
}

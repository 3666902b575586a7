package org.modar;

import android.content.res.AssetManager;
import java.io.IOException;
import java.io.StringReader;
import java.util.Locale;
import java.util.Properties;

/** What the screen says: the asset words.properties. */
final class Words {
    private final Properties words = new Properties();

    Words(AssetManager assets) {
        try {
            words.load(new StringReader(Bundles.text(assets.open("words.properties"))));
        } catch (IOException none) {
            return; // keys will have to do
        }
    }

    String get(String key, Object... values) {
        return String.format(Locale.ROOT, words.getProperty(key, key), values);
    }

    /** Advice for the tracker's reason; the same for all that have none of their own. */
    String advice(String reason) {
        return words.getProperty(reason, get("nothing"));
    }
}

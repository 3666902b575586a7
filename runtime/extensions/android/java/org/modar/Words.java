package org.modar;

import android.content.res.AssetManager;
import java.io.IOException;
import java.io.StringReader;
import java.util.List;
import java.util.Locale;
import java.util.Properties;

/** What the screen says: the asset words.properties, and over it words-LANGUAGE.properties of the phone's language. */
final class Words {
    private final Properties words = new Properties();

    Words(AssetManager assets, Locale locale) {
        String language = locale.getLanguage();
        for (String tail : new String[] {"", "-" + language, "-" + language + "-" + locale.getCountry()}) {
            try {
                words.load(new StringReader(Bundles.text(assets.open("words" + tail + ".properties"))));
            } catch (IOException none) {
                continue; // the words before have to do
            }
        }
    }

    String get(String key, Object... values) {
        return String.format(Locale.ROOT, words.getProperty(key, key), values);
    }

    /** Of languages (BCP 47 tags) the one to show: that of the locale, that with other regions, English, the first; null: none. */
    static String best(List<String> languages, Locale locale) {
        String wanted = locale.getLanguage() + "-" + locale.getCountry();
        String best = null;
        int bestRank = -1;
        for (String tag : languages) {
            String language = tag.split("-")[0];
            int rank = tag.equalsIgnoreCase(wanted)                   ? 4
                    : tag.equalsIgnoreCase(locale.getLanguage())      ? 3
                    : language.equalsIgnoreCase(locale.getLanguage()) ? 2
                    : language.equals("en")                           ? 1
                                                                      : 0;
            if (rank <= bestRank) continue;
            best = tag;
            bestRank = rank;
        }
        return best;
    }
}

package org.modar;

import java.util.ArrayList;
import java.util.List;
import java.util.Locale;
import java.util.Properties;

/** What the app says of a bundle's patterns and models: NAME.properties next to it, else the bundle's own texts in the phone's language. */
final class Texts {
    private final Properties own;
    private final String[] shown;
    private final String[] alternative;
    /** Of the bundle's, that of the phone or the nearest; null: it has none. */
    final String language;

    Texts(Properties own, long session, String[] patterns, Locale locale) throws ModarException {
        this.own = own;
        List<String> languages = new ArrayList<>();
        for (String each = Native.language(session, 0); each != null;
                each = Native.language(session, languages.size())) {
            languages.add(each);
        }
        language = Words.best(languages, locale);
        shown = new String[patterns.length];
        alternative = new String[patterns.length];
        for (int i = 0; i < patterns.length && language != null; i++) {
            shown[i] = Native.patternText(session, i, false, language);
            alternative[i] = Native.patternText(session, i, true, language);
        }
        for (int i = 0; i < patterns.length; i++) {
            shown[i] = own.getProperty(patterns[i], shown[i] != null ? shown[i] : "");
        }
    }

    /** What to show while a pattern is seen; may be empty. */
    String shown(int pattern) {
        return shown[pattern];
    }

    /** The view in words, for screen readers; null: the bundle does not say. */
    String alternative(int pattern) {
        return alternative[pattern];
    }

    String model(String name) {
        return own.getProperty(name, name);
    }

    /** What advice calls a pattern. */
    String name(String pattern) {
        return own.getProperty(pattern + ".name", pattern);
    }
}

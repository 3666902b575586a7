package org.modar;

/** Where the eye is in a look without a camera. Changed by the main thread, read by GL's. */
final class Orbit {
    /** The eye's first elevation and its limits, in radians: as on the page. */
    private static final double FIRST_TILT = Math.toRadians(32);
    private static final double LOWEST = Math.toRadians(8);
    private static final double HIGHEST = Math.toRadians(86);

    final int pattern;
    volatile double turn;
    volatile double tilt = FIRST_TILT;
    volatile double zoom = 1;

    Orbit(int pattern) {
        this.pattern = pattern;
    }

    /** A finger across the screen is half a turn, along it a quarter. */
    void follow(Gestures gestures) {
        turn = -gestures.turn;
        tilt = Math.max(LOWEST, Math.min(HIGHEST, FIRST_TILT - gestures.shift * Math.PI / 8));
        zoom = gestures.scale;
    }
}

package org.modar;

import android.hardware.Sensor;
import android.hardware.SensorEvent;
import android.hardware.SensorEventListener;
import android.hardware.SensorManager;
import android.os.Handler;

/** How the phone turned between two frames, about the axes that Android's sensors have; on the camera's thread. */
final class Gyroscope implements SensorEventListener {
    /** Three readings a frame; up to five times as many need no permission. */
    private static final int PERIOD_US = 10000;
    /** Readings that are further apart leave the turn unknown. */
    private static final double LONGEST_GAP_S = 0.1;
    /** Readings that are kept, of 2.5 seconds: a frame is looked at later than it was taken. */
    private static final int KEPT = 256;

    /** What turn() found: a rotation vector, radians. */
    final double[] turned = new double[3];
    private final SensorManager manager;
    /** Seconds, radians a second. */
    private final double[][] readings = new double[KEPT][4];
    private int count;

    private Gyroscope(SensorManager manager) {
        this.manager = manager;
    }

    /** Null: the phone has none. */
    static Gyroscope open(SensorManager manager, Handler handler) {
        Sensor sensor = manager.getDefaultSensor(Sensor.TYPE_GYROSCOPE);
        if (sensor == null) return null;
        Gyroscope made = new Gyroscope(manager);
        manager.registerListener(made, sensor, PERIOD_US, handler);
        return made;
    }

    void close() {
        manager.unregisterListener(this);
    }

    @Override
    public void onSensorChanged(SensorEvent event) {
        double[] reading = readings[count++ % KEPT];
        reading[0] = event.timestamp * 1e-9;
        for (int axis = 0; axis < 3; axis++) reading[axis + 1] = event.values[axis];
    }

    @Override
    public void onAccuracyChanged(Sensor sensor, int accuracy) {}

    /** From one time to another, by the clock of the readings; false where they lack. */
    boolean turn(double fromS, double toS) {
        double known = fromS;
        for (int axis = 0; axis < 3; axis++) turned[axis] = 0;
        for (int i = Math.max(0, count - KEPT); i < count && known < toS; i++) {
            double[] before = readings[i % KEPT];
            double[] after = i + 1 < count ? readings[(i + 1) % KEPT] : before;
            double until = after[0];
            if (after == before || until - before[0] > LONGEST_GAP_S) {
                after = before;
                until = before[0] + LONGEST_GAP_S;
            }
            double end = Math.min(until, toS);
            if (end <= known) continue;
            if (before[0] > known) return false;
            for (int axis = 0; axis < 3; axis++) {
                turned[axis] += (end - known) * (before[axis + 1] + after[axis + 1]) / 2;
            }
            known = end;
        }
        return known >= toS;
    }
}

package org.modar;

/** A frame of the camera with the poses found in it. Its pixels are lent until release(). */
abstract class Frame {
    final Poses poses;
    double timeS;
    /** It was drawn: GL has its pixels. */
    boolean drawn;

    Frame(int poseCount) {
        poses = new Poses(poseCount);
    }

    /** On the camera's thread: how many patterns and copies are visible. */
    abstract int track(long session) throws ModarException;

    /** On GL's thread. */
    abstract void draw(long session) throws ModarException;

    /** Gives the pixels back to the camera; from any thread. */
    abstract void release();
}

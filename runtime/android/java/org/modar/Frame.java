package org.modar;

import android.media.Image;
import java.nio.ByteBuffer;

/** A frame of the camera with the poses found in it. Its pixels are lent until release(). */
abstract class Frame {
    final Poses poses;
    double timeS;

    Frame(int patterns) {
        poses = new Poses(patterns);
    }

    /** On the camera's thread. */
    abstract int track(long session) throws ModarException;

    /** On GL's thread. */
    abstract void draw(long session) throws ModarException;

    /** Gives the pixels back to the camera; from any thread. */
    abstract void release();

    /** NV21 in the callback buffer of android.hardware.Camera. */
    static final class Nv21 extends Frame {
        /** Where a buffer goes when it is free. */
        interface Owner {
            void free(byte[] buffer);
        }

        final byte[] pixels;
        private final Owner owner;

        Nv21(int patterns, byte[] pixels, Owner owner) {
            super(patterns);
            this.pixels = pixels;
            this.owner = owner;
        }

        @Override
        int track(long session) throws ModarException {
            return Native.onCameraFrame(session, pixels, timeS, poses.bytes);
        }

        @Override
        void draw(long session) throws ModarException {
            Native.onDrawFrame(session, pixels, poses.bytes);
        }

        @Override
        void release() {
            owner.free(pixels);
        }
    }

    /** The planes of an Image of Camera2. */
    static final class Planes extends Frame {
        /** Where the frame goes when its Image is closed. */
        interface Owner {
            void free(Planes frame);
        }

        private final Owner owner;
        private Image image;
        private Image.Plane[] planes;

        Planes(int patterns, Owner owner) {
            super(patterns);
            this.owner = owner;
        }

        void take(Image next) {
            image = next;
            planes = next.getPlanes();
            timeS = next.getTimestamp() * 1e-9;
        }

        @Override
        int track(long session) throws ModarException {
            ByteBuffer luma = planes[0].getBuffer();
            return Native.onCameraPlane(session, luma, planes[0].getRowStride(), timeS, poses.bytes);
        }

        @Override
        void draw(long session) throws ModarException {
            Native.onDrawPlanes(session, planes[0].getBuffer(), planes[0].getRowStride(), planes[1].getBuffer(),
                    planes[2].getBuffer(), planes[1].getRowStride(), planes[1].getPixelStride(), poses.bytes);
        }

        @Override
        void release() {
            image.close();
            image = null;
            planes = null;
            owner.free(this);
        }
    }
}

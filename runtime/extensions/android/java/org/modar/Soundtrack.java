package org.modar;

import android.media.MediaCodec;
import android.media.MediaExtractor;
import android.media.MediaFormat;
import android.media.MediaMuxer;
import java.nio.ByteBuffer;

/** The sound of a bundle while a video of the screen is recorded: unchanged packets of the bundle's own AAC. On GL's thread. */
final class Soundtrack {
    /** Milliseconds between where a sound is and where it was to be, from which on it was moved: decoders tell it by frames of 23 ms. */
    private static final int MOVED_MS = 150;
    /** Bytes of a packet, at most: 8192 for two channels by AAC's own rule. */
    private static final int PACKET = 1 << 14;

    private final Media media;
    private final MediaFormat format;
    private final ByteBuffer packet = ByteBuffer.allocateDirect(PACKET);
    private final MediaCodec.BufferInfo about = new MediaCodec.BufferInfo();
    private final int[] place = new int[1];
    private MediaExtractor reader;
    private int node;
    /** Microseconds from a place in the file to the one in the recording. */
    private long offset;
    private long last = -1;

    private Soundtrack(Media media, int node, MediaExtractor reader, MediaFormat format) {
        this.media = media;
        this.node = node;
        this.reader = reader;
        this.format = format;
        offset = Long.MIN_VALUE;
    }

    /** Null where nothing is heard now. media may be null. */
    static Soundtrack of(Media media) {
        int node = media == null ? -1 : media.heard(new int[1]);
        MediaExtractor reader = node < 0 ? null : media.reader(node);
        MediaFormat format = reader == null ? null : soundOf(reader);
        return format == null ? null : new Soundtrack(media, node, reader, format);
    }

    /** Selects a file's sound. */
    private static MediaFormat soundOf(MediaExtractor reader) {
        for (int i = 0; i < reader.getTrackCount(); i++) {
            MediaFormat each = reader.getTrackFormat(i);
            if (!each.getString(MediaFormat.KEY_MIME).startsWith("audio/")) continue;
            reader.selectTrack(i);
            return each;
        }
        return null;
    }

    int addTo(MediaMuxer muxer) {
        return muxer.addTrack(format);
    }

    /** The sound so far, microseconds of the recording. Sounds of another kind than the first are left out. */
    void write(MediaMuxer muxer, int track, long now) {
        int heard = media.heard(place);
        if (heard < 0) {
            offset = Long.MIN_VALUE;
            return;
        }
        if (heard != node && !change(heard)) return;
        if (reader == null) return;
        long at = 1000L * place[0];
        if (offset == Long.MIN_VALUE || Math.abs(now - offset - at) > 1000L * MOVED_MS) {
            // It was heard from the recording's beginning on, before the encoder's first picture came.
            reader.seekTo(last < 0 ? Math.max(0, at - now) : at, MediaExtractor.SEEK_TO_CLOSEST_SYNC);
            offset = now - at;
        }
        for (long time = reader.getSampleTime(); time >= 0 && time + offset <= now; time = reader.getSampleTime()) {
            about.set(0, reader.readSampleData(packet, 0), time + offset, MediaCodec.BUFFER_FLAG_SYNC_FRAME);
            if (about.size > 0 && about.presentationTimeUs > last) {
                last = about.presentationTimeUs;
                muxer.writeSampleData(track, packet, about);
            }
            reader.advance();
        }
    }

    private boolean change(int heard) {
        close();
        node = heard;
        offset = Long.MIN_VALUE;
        reader = media.reader(heard);
        MediaFormat other = reader == null ? null : soundOf(reader);
        boolean same = other != null;
        for (String key : new String[] {MediaFormat.KEY_SAMPLE_RATE, MediaFormat.KEY_CHANNEL_COUNT}) {
            same = same && other.getInteger(key) == format.getInteger(key);
        }
        if (!same) close();
        return same;
    }

    void close() {
        if (reader != null) reader.release();
        reader = null;
    }
}

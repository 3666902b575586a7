package org.modar;

import android.graphics.SurfaceTexture;
import android.media.MediaExtractor;
import android.media.MediaPlayer;
import android.opengl.GLES11Ext;
import android.opengl.GLES20;
import android.view.Surface;
import java.io.File;
import java.io.FileInputStream;
import java.io.FileOutputStream;
import java.io.IOException;
import java.nio.ByteBuffer;
import java.util.ArrayList;
import java.util.List;

/**
 * The videos and sounds of a bundle, decoded by the phone. A player is made when its node first plays: until then a
 * video's poster is shown. Silent until the visitor asks for sound. Methods of GL's thread say so; the others may be called
 * from any.
 */
final class Media implements MediaPlayer.OnPreparedListener, MediaPlayer.OnCompletionListener,
                             SurfaceTexture.OnFrameAvailableListener {
    private static final class Player {
        final int node;
        final int[] about;
        MediaPlayer decoder;
        boolean prepared;
        boolean wanted;
        boolean ended;
        /** Where it continues after GL's context was lost, milliseconds. */
        int from;
        SurfaceTexture pictures;
        Surface surface;
        boolean fresh;
        int external;
        int texture;

        Player(int node, int[] about) {
            this.node = node;
            this.about = about;
        }
    }

    private final long session;
    private final File folder;
    private final Runnable redraw;
    private final List<Player> players = new ArrayList<>();
    private final VideoCopy copy = new VideoCopy(GLES11Ext.GL_TEXTURE_EXTERNAL_OES);
    private final float[] map = new float[16];
    /** The app is in the background. */
    private boolean held;
    private boolean paused;
    private boolean sound;

    /** folder: for files that are removed at once. redraw: there is something new to draw. */
    Media(long session, File folder, Runnable redraw) throws ModarException {
        this.session = session;
        this.folder = folder;
        this.redraw = redraw;
        int[] about = Native.node(session, 0);
        for (int i = 0; about != null; about = Native.node(session, ++i)) {
            if (about[Native.KIND] == Native.VIDEO || about[Native.KIND] == Native.SOUND)
                players.add(new Player(i, about));
        }
    }

    boolean isEmpty() {
        return players.isEmpty();
    }

    /** On GL's thread: what of the commands of Native.act() concerns media. */
    synchronized void execute(int[] commands) throws ModarException {
        follow();
        for (int i = 0; i < commands.length; i += 3) {
            Player player = of(commands[i + 1]);
            if (player == null || (commands[i] != Native.PLAY && commands[i] != Native.PAUSE)) continue;
            player.wanted = commands[i] == Native.PLAY;
            if (player.wanted && player.decoder == null) open(player);
            follow(player);
        }
    }

    private Player of(int node) {
        for (Player each : players) {
            if (each.node == node) return each;
        }
        return null;
    }

    private Player of(Object decoder) {
        for (Player each : players) {
            if (each.decoder == decoder) return each;
        }
        return null;
    }

    /** Hands a node's file over. What takes it has its descriptor: the file itself is gone after that. */
    private void give(int node, MediaPlayer decoder, MediaExtractor reader) throws IOException, ModarException {
        File file = File.createTempFile("media", ".mp4", folder);
        try {
            FileOutputStream out = new FileOutputStream(file);
            try {
                ByteBuffer bytes = Native.media(session, node);
                while (bytes.hasRemaining()) out.getChannel().write(bytes);
            } finally {
                out.close();
            }
            FileInputStream in = new FileInputStream(file);
            try {
                if (decoder != null) decoder.setDataSource(in.getFD());
                else reader.setDataSource(in.getFD());
            } finally {
                in.close();
            }
        } finally {
            file.delete();
        }
    }

    /** The node that is heard now, whose place in its file becomes ms[0]; -1: none. */
    synchronized int heard(int[] ms) {
        for (Player each : players) {
            if (!sound || !each.prepared || each.about[Native.HAS_SOUND] == 0 || !each.decoder.isPlaying()) continue;
            ms[0] = each.decoder.getCurrentPosition();
            return each.node;
        }
        return -1;
    }

    /** Of a node that is heard; null where the phone cannot read it. */
    MediaExtractor reader(int node) {
        MediaExtractor reader = new MediaExtractor();
        try {
            give(node, null, reader);
            return reader;
        } catch (IOException | ModarException closed) {
            reader.release();
        }
        return null;
    }

    private void open(Player player) throws ModarException {
        MediaPlayer decoder = new MediaPlayer();
        try {
            give(player.node, decoder, null);
        } catch (IOException full) {
            decoder.release();
            player.wanted = false;
            throw new ModarException(2, "android.media", "media", "it cannot be played: " + full.getMessage(),
                    "free space on the phone");
        }
        if (player.about[Native.KIND] == Native.VIDEO) {
            player.external = VideoCopy.texture(GLES11Ext.GL_TEXTURE_EXTERNAL_OES, 0, 0);
            player.texture
                    = VideoCopy.texture(GLES20.GL_TEXTURE_2D, player.about[Native.WIDTH], player.about[Native.HEIGHT]);
            player.pictures = new SurfaceTexture(player.external);
            player.pictures.setOnFrameAvailableListener(this);
            player.surface = new Surface(player.pictures);
            decoder.setSurface(player.surface);
        }
        decoder.setLooping(player.about[Native.LOOPS] != 0);
        decoder.setOnPreparedListener(this);
        decoder.setOnCompletionListener(this);
        player.decoder = decoder;
        loudness(player);
        decoder.prepareAsync();
    }

    @Override
    public synchronized void onPrepared(MediaPlayer decoder) {
        Player player = of(decoder);
        if (player == null) return;
        player.prepared = true;
        if (player.from > 0) decoder.seekTo(player.from);
        follow(player);
    }

    @Override
    public synchronized void onCompletion(MediaPlayer decoder) {
        Player player = of(decoder);
        if (player == null) return;
        player.wanted = false;
        player.ended = true;
        redraw.run();
    }

    @Override
    public synchronized void onFrameAvailable(SurfaceTexture pictures) {
        for (Player each : players) each.fresh |= each.pictures == pictures;
        redraw.run();
    }

    private void follow(Player player) {
        if (!player.prepared) return;
        boolean plays = player.wanted && !held && !paused;
        if (plays == player.decoder.isPlaying()) return;
        if (plays) player.decoder.start();
        else player.decoder.pause();
    }

    /** On GL's thread, before Native.act(): what ended since. */
    synchronized void tellEnded() throws ModarException {
        for (Player each : players) {
            if (each.ended) Native.ended(session, each.node);
            each.ended = false;
        }
    }

    /** On GL's thread, before drawing: the newest picture of each video. */
    synchronized void upload() throws ModarException {
        for (Player each : players) {
            if (!each.fresh) continue;
            each.fresh = false;
            each.pictures.updateTexImage();
            each.pictures.getTransformMatrix(map);
            copy.draw(each.external, map, each.texture, each.about[Native.WIDTH], each.about[Native.HEIGHT]);
            Native.setVideo(session, each.node, each.texture);
        }
    }

    /** On GL's thread: the old context was lost with its textures; playing media continues in the new one. */
    synchronized void renew() throws ModarException {
        copy.forget();
        for (Player each : players) {
            if (each.pictures == null) continue;
            int at = each.prepared ? each.decoder.getCurrentPosition() : each.from;
            release(each);
            each.from = at;
            if (each.wanted) open(each);
        }
    }

    private static void release(Player player) {
        if (player.decoder != null) player.decoder.release();
        if (player.surface != null) player.surface.release();
        if (player.pictures != null) player.pictures.release();
        player.decoder = null;
        player.surface = null;
        player.pictures = null;
        player.prepared = false;
        player.fresh = false;
    }

    /** On GL's thread, before the session is closed. Textures go with the context or stay until then. */
    synchronized void close() {
        for (Player each : players) release(each);
        players.clear();
    }

    /** The app goes to the background, or is back. */
    synchronized void hold(boolean on) {
        held = on;
        for (Player each : players) follow(each);
    }

    /** What the visitor wants of sound now. */
    synchronized void follow() throws ModarException {
        int[] status = Native.status(session);
        sound = status[Native.HEARD] != 0;
        paused = status[Native.PAUSED] != 0;
        for (Player each : players) {
            loudness(each);
            follow(each);
        }
    }

    private void loudness(Player player) {
        if (player.decoder != null) player.decoder.setVolume(sound ? 1 : 0, sound ? 1 : 0);
    }

    /** The sound of now, or what would sound; empty: nothing. */
    synchronized String caption(String language) throws ModarException {
        StringBuilder text = new StringBuilder();
        for (Player each : players) {
            if (!each.wanted || !each.prepared) continue;
            String words = Native.caption(session, each.node, language, each.decoder.getCurrentPosition() / 1000.0);
            if (words != null) text.append(text.length() == 0 ? "" : "\n").append(words);
        }
        return text.toString();
    }

    /** All that is heard on a pattern; empty: nothing has captions. */
    synchronized String transcript(int pattern, String language) throws ModarException {
        StringBuilder text = new StringBuilder();
        for (Player each : players) {
            String words
                    = each.about[Native.PATTERN] == pattern ? Native.caption(session, each.node, language, -1) : null;
            if (words != null) text.append(text.length() == 0 ? "" : "\n").append(words);
        }
        return text.toString();
    }
}

package org.modar;

/** What went wrong, for a program (status, code) and for a person: the parts of the C API's modar_error. */
public final class ModarException extends Exception {
    private static final long serialVersionUID = 1;
    /** 1 usage, 2 input or output, 3 invalid input, 4 a bug of ModAR, 5 unsupported; 10 to 17 of a fetch. */
    public final int status;
    /** Stable, like "bundle.truncated". */
    public final String code;
    public final String where;
    public final String cause;
    public final String cure;

    public ModarException(int status, String code, String where, String cause, String cure) {
        super(code + ": " + where + ": " + cause + "; " + cure);
        this.status = status;
        this.code = code;
        this.where = where;
        this.cause = cause;
        this.cure = cure;
    }
}

"""Servers on loopback: a real nginx, a line that breaks, and one that misbehaves."""
import contextlib
import functools
import http.server
import pathlib
import random
import shutil
import socket
import ssl
import subprocess
import threading
import time
import urllib.error
import urllib.request

NGINX = shutil.which("nginx") or shutil.which("nginx", path="/usr/sbin")

CONFIG = """
worker_processes 1; daemon off; master_process off; pid {folder}/nginx.pid; error_log {folder}/error.log;
events {{ worker_connections 256; }}
http {{
  access_log {folder}/access.log combined; default_type application/octet-stream; sendfile off;
  client_body_temp_path {folder}/t1; proxy_temp_path {folder}/t2; fastcgi_temp_path {folder}/t3;
  uwsgi_temp_path {folder}/t4; scgi_temp_path {folder}/t5;
  server {{
    listen 127.0.0.1:{port};
    location /plain/ {{ alias {root}/; }}
    location /slow/ {{ alias {root}/; limit_rate {rate}; }}
    location /noranges/ {{ alias {root}/; max_ranges 0; }}
    location /broken/ {{ return 500; }}
    location /nothing/ {{ return 404; }}
  }}
}}
"""


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


class Nginx:
    """Serves `root` under /plain, /slow (2G: 35 kB/s a connection), /noranges, /broken and /nothing."""

    def __init__(self, root, folder, rate="35k"):
        folder = pathlib.Path(folder)
        folder.mkdir()
        self.port = free_port()
        self.log = folder / "access.log"
        config = folder / "nginx.conf"
        config.write_text(CONFIG.format(folder=folder, root=root, port=self.port, rate=rate))
        self.process = subprocess.Popen([NGINX, "-p", str(folder), "-c", str(config)], stderr=subprocess.DEVNULL)
        for _ in range(200):
            try:
                urllib.request.urlopen(f"http://127.0.0.1:{self.port}/nothing/").close()
            except urllib.error.HTTPError:
                return
            except OSError:
                time.sleep(0.05)
        raise RuntimeError("nginx does not start")

    def url(self, location="plain"):
        return f"http://127.0.0.1:{self.port}/{location}"

    def stop(self):
        self.process.terminate()
        self.process.wait()


class Keeper:
    """Serves `root`, and delays requests while `held()`."""

    def __init__(self, root, held):
        class Handler(http.server.SimpleHTTPRequestHandler):
            def do_GET(handler):
                while held() and not self.stopped:
                    time.sleep(0.02)
                with contextlib.suppress(OSError):  # the client is gone
                    super().do_GET()

            def log_message(self, *_):
                pass

        self.stopped = False
        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Handler, directory=root))
        threading.Thread(target=self.server.serve_forever, daemon=True).start()

    def url(self):
        return f"http://127.0.0.1:{self.server.server_port}"

    def stop(self):
        self.stopped = True
        self.server.shutdown()
        self.server.server_close()


class BreakingLine:
    """Passes connections on to a server and breaks each after a random number of its bytes."""

    def __init__(self, port, seed, most):
        self.target = port
        self.random = random.Random(seed)
        self.most = most
        self.breaks = 0
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        threading.Thread(target=self.accept, daemon=True).start()

    def accept(self):
        while True:
            try:
                client, _ = self.listener.accept()
            except OSError:
                return
            threading.Thread(target=self.serve, args=(client, self.random.randrange(1, self.most)), daemon=True).start()

    def serve(self, client, left):
        with client, socket.create_connection(("127.0.0.1", self.target)) as server:
            threading.Thread(target=self.pump_up, args=(client, server), daemon=True).start()
            try:
                while left > 0:
                    data = server.recv(min(4096, left))
                    if not data:
                        return
                    client.sendall(data)
                    left -= len(data)
                self.breaks += 1
                client.shutdown(socket.SHUT_RDWR)
            except OSError:
                pass

    @staticmethod
    def pump_up(client, server):
        try:
            while data := client.recv(4096):
                server.sendall(data)
        except OSError:
            pass

    def stop(self):
        self.listener.close()


class RudeServer:
    """Serves `root`; `rude(path, attempt)` may name a way to answer wrongly:
    garbage, short, long, 416, 404, 500, 511, redirect:URL, drip (a byte a second), byte (one byte, then the end), bare (no header), page
    (a web page)."""

    def __init__(self, root, rude, certificate=None):
        root = pathlib.Path(root)
        attempts = {}

        class Handler(http.server.BaseHTTPRequestHandler):
            def log_message(self, *_):
                pass

            def do_GET(self):
                attempts[self.path] = attempts.get(self.path, 0) + 1
                way = rude(self.path, attempts[self.path])
                if way and way.startswith("redirect:"):
                    self.send_response(302)
                    self.send_header("Location", way.removeprefix("redirect:") + self.path)
                    self.send_header("Content-Length", "0")
                    self.end_headers()
                    return
                file = root / self.path.lstrip("/")
                if way in ("404", "416", "500", "511") or not file.is_file():
                    self.send_response(int(way) if way and way.isdigit() else 404)
                    self.send_header("Content-Length", "5")
                    self.end_headers()
                    self.wfile.write(b"sorry")
                    return
                data = file.read_bytes()
                if way == "bare":
                    self.wfile.write(data)
                    return
                if way == "page":
                    data = b"\n<!DOCTYPE html><title>Free WLAN</title>" + bytes(100)
                length = len(data)
                if way == "garbage":
                    data = bytes(b ^ 0x55 for b in data)
                if way == "short":
                    data = data[:len(data) // 2]
                if way == "long":
                    data = data * 3
                    length = len(data)
                self.send_response(200)
                self.send_header("Content-Length", str(length))
                self.end_headers()
                try:
                    if way == "byte":
                        data = data[:1]
                    while way == "drip" and data:
                        self.wfile.write(data[:1])
                        data = data[1:]
                        time.sleep(1)
                    self.wfile.write(data)
                except OSError:
                    pass

        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.scheme = "http"
        if certificate:
            self.scheme = "https"
            context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
            context.load_cert_chain(*certificate)
            self.server.socket = context.wrap_socket(self.server.socket, server_side=True)
        threading.Thread(target=self.server.serve_forever, daemon=True).start()

    def url(self):
        return f"{self.scheme}://127.0.0.1:{self.server.server_address[1]}"

    def stop(self):
        self.server.shutdown()
        self.server.server_close()

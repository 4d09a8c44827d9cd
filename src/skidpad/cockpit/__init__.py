"""The cockpit: see a drive, drive it, and replay it, in a browser page of this machine.

producer (a process)                                   page server (the command's process)
the one loop, or a log ──► Screen ──► shared memory ──► JPEG ──► websocket ──► canvas
          ▲                                                          │
          └──────────────────── words through a pipe ◄───────────────┘
"""

"""The page's server: access, checks of each message, sessions.

browser -> AccessHandler (handshake) -> GuardedConnection (each message) -> viser -> callbacks
PageServer: a connection per window, a session per browser, a page per connection
"""
